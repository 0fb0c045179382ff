"""The page's block that sticks and slips, against its closed form."""

from __future__ import annotations

import re
import sys
import types

import numpy as np
import pytest

from tests.conftest import ROOT

PAGE = ROOT / "runs" / "how-to" / "own-motion.md"


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    """What the first Python block of the page leaves behind."""
    text = re.search(r"```python\n(.*?)```", PAGE.read_text(), re.S)[1]
    file = tmp_path_factory.mktemp("friction") / "dragged.py"
    file.write_text(text)
    sys.modules["dragged"] = module = types.ModuleType("dragged")
    exec(compile(text, str(file), "exec"), module.__dict__)
    return module


def test_it_is_the_closed_form(page):
    """Each slip is a piece of a cosine of the stretch about that of the sliding."""
    m, k, u, rest, sliding = page.parts
    w, more = np.sqrt(k / m), (rest - sliding) / k
    amplitude = np.hypot(more, u / w)
    slip = (2 * np.pi - 2 * np.arctan2(more * w, u)) / w  # until the end is as fast
    stick = 2 * more / u
    way = u * slip + 2 * more
    assert page.found.greatest[0, 0] == pytest.approx(sliding + k * amplitude, 1e-6)
    # whole slips, and then at rest
    left = (10.0 - rest / k / u) / (slip + stick)
    slips = int(left) + 1
    assert left % 1 * (slip + stick) > slip
    x, v = page.found.states[0, -1]
    assert x == pytest.approx(slips * way, 1e-6)
    assert v == pytest.approx(0.0, abs=1e-6)
    assert page.found.quadratures[0, -1, 0] == pytest.approx(sliding * x, 1e-5)
