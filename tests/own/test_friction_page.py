"""The page's block that sticks and slips, and its mass between two flanks."""

from __future__ import annotations

import re
import sys
import types

import numpy as np
import pytest

from tests.conftest import ROOT
from tests.integrator.test_jumps import by_phases, event, same

PAGE = ROOT / "runs" / "how-to" / "own-motion.md"


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    """What the Python blocks of the page leave behind."""
    found, blocks = [], re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.S)
    for i, text in enumerate(blocks):
        file = tmp_path_factory.mktemp("page") / f"block_{i}.py"
        file.write_text(text)
        sys.modules[file.stem] = module = types.ModuleType(file.stem)
        exec(compile(text, str(file), "exec"), module.__dict__)
        found.append(module)
    return found


def test_the_dragged_block_is_the_closed_form(ran):
    """Each slip is a piece of a cosine of the stretch about that of the sliding."""
    page, _ = ran
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


def test_the_mass_between_two_flanks_is_that_of_scipy(ran):
    """DOP853, which ends at each event and begins again behind it."""
    _, page = ran
    m, play, k, b, F, w = page.parts

    def moving(force):
        return lambda t, y: (y[1], (F * np.cos(w * t) + force(*y)) / m)

    def flank(s):
        """Return the motion on a flank, until the mass leaves it."""
        leaves = event(lambda t, y: s * y[0] - play, -1)
        pressed = moving(lambda x, v: -k * (x - s * play) - b * v)
        return pressed, {"free": (leaves, same)}

    meets = {
        name: (event(lambda t, y, s=s: s * y[0] - play, 1), same)
        for name, s in (("upper", 1), ("lower", -1))
    }
    free = moving(lambda x, v: 0.0), meets
    phases = {"free": free, "upper": flank(1), "lower": flank(-1)}
    known = by_phases(phases, "free", [0.0, 0.0])
    assert page.found.states[0, -1] == pytest.approx(known, abs=1e-6)
    # both flanks were met, and pushed harder than the cosine alone
    assert page.found.least[0, 0] < -F and page.found.greatest[0, 0] > F
