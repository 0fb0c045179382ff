"""The page's block that sticks and slips, and its mass between two flanks."""

from __future__ import annotations

import re
import sys
import types

import numpy as np
import pytest

from tests.conftest import ROOT
from tests.integrator.phases import by_phases, event, same

PAGE = ROOT / "runs" / "how-to" / "own-rates.md"


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


@pytest.mark.parametrize(
    "other",
    [{}, {"b": 12.0}, {"b": 30.0, "k": 400.0}, {"play": 0.02, "F": 5.0}],
    ids=str,
)
def test_the_mass_between_two_flanks_is_that_of_scipy(ran, other):
    """DOP853, which ends at each event and begins again behind it."""
    _, page = ran
    m, play, k, b, F, w = parts = page.parts._replace(**other)
    found = page.integrate(
        page.SYSTEM, np.zeros((1, 2)), np.array([parts]), np.array([[0.0, 12.0]]),
        page.Accuracy(1e-10, 0.05),
    )  # fmt: skip

    def push(s, y):
        """Return the force of a flank, which pushes where it is above zero."""
        return k * (s * y[0] - play) + b * s * y[1]

    def moving(force):
        return lambda t, y: (y[1], (F * np.cos(w * t) + force(y)) / m)

    def flank(s, off):
        """Return the motion on a flank, until it would have to pull."""
        leaves = event(lambda t, y: push(s, y), -1)
        return moving(lambda y: -s * push(s, y)), {off: (leaves, same)}

    def behind(s, on):
        """Return the motion off a flank, which the mass has not cleared yet."""
        clears = event(lambda t, y: s * y[0] - play, -1)
        meets = event(lambda t, y: push(s, y), 1)
        return moving(lambda y: 0.0), {"free": (clears, same), on: (meets, same)}

    meets = {
        name: (event(lambda t, y, s=s: s * y[0] - play, 1), same)
        for name, s in (("upper", 1), ("lower", -1))
    }
    phases = {
        "free": (moving(lambda y: 0.0), meets),
        "upper": flank(1, "off upper"), "off upper": behind(1, "upper"),
        "lower": flank(-1, "off lower"), "off lower": behind(-1, "lower"),
    }  # fmt: skip
    known = by_phases(phases, "free", [0.0, 0.0])
    assert found.states[0, -1] == pytest.approx(known, abs=1e-6)
    if not other:
        assert page.found.states[0, -1] == pytest.approx(known, abs=1e-6)
    # both flanks were met, and pushed harder than the cosine alone
    assert found.least[0, 0] < -F and found.greatest[0, 0] > F
