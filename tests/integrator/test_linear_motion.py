"""Linear motion: peaks of sums of modes, against the closed form."""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
import pytest

from tolstat.errors import ModelError
from tolstat.integrator.linear_motion import LinearMotion, solve
from tolstat.status import Status

TRIALS, MODES, WATCHED = 40, 4, 3
APART = 5e-5  # s, of the scan: (omega APART)^4 = 2e-11


def swinging(omega, amplitude, cosine, sine, end=1.0):
    """Modes without damping that start with a jump: (a cos, a sin) in each sum."""
    n, every = len(omega), np.arange(MODES)
    entries = np.vstack(
        [
            np.stack([every, MODES + every], axis=1),
            np.stack([MODES + every, every], axis=1),
        ]
    )
    return LinearMotion(
        MODES, 0, entries, np.hstack([omega, -omega]),
        np.tile([0.0, end], (n, 1)), np.hstack([cosine, sine])[:, None, :],
        amplitude, np.zeros((n, 1, WATCHED)), np.zeros((n, WATCHED)),
    )  # fmt: skip


@pytest.mark.parametrize("power", [0.0, 1.0, 2.0])
def test_no_peak_is_passed_over(power):
    """Fast modes turn several times in a step of the slow ones, large or small."""
    rng = np.random.default_rng(5)
    omega = np.sort(rng.uniform(2.0, 40.0, (TRIALS, MODES)), axis=1)
    amplitude = rng.normal(size=(TRIALS, WATCHED, MODES)) / omega[:, None] ** power
    cosine, sine = rng.normal(size=(2, TRIALS, MODES))
    found = solve(swinging(omega, amplitude, cosine, sine))
    t = np.arange(0.0, 1.0 + 0.5 * APART, APART)
    for trial in range(TRIALS):
        angle = omega[trial, :, None] * t
        modes = cosine[trial, :, None] * np.cos(angle)
        modes += sine[trial, :, None] * np.sin(angle)
        for o, x in enumerate(amplitude[trial] @ modes):
            size = np.abs(x).max()
            for side, top in ((x, found.greatest), (-x, -found.least)):
                i = side.argmax()
                known = side[i]
                if 0 < i < len(t) - 1:  # of the parabola through three times
                    rise, bend = side[i + 1] - side[i - 1], np.diff(side[i - 1 : i + 2])
                    known -= rise**2 / (8.0 * (bend[1] - bend[0]))
                assert top[trial, o] == pytest.approx(known, abs=1e-10 * size)


def test_a_bump_in_a_step_whose_cubic_dips():
    """One step from zero down, and up to zero: only the bound tells of the bump."""
    omega, end = np.array([5.0, 10.0, 20.0, 40.0]), 0.999 * np.pi / 80.0

    def basis(t):
        angle = np.multiply.outer(t, omega)
        return np.concatenate([np.cos(angle), np.sin(angle)], axis=-1)

    ends = basis(np.array([0.0, end]))
    slopes = np.hstack([-omega * ends[:, MODES:], omega * ends[:, :MODES]])
    conditions, inside = np.vstack([ends, slopes]), basis(np.linspace(0.0, end, 9999))
    flat = np.linalg.svd(conditions)[2][-1]  # no value, no slope at the ends
    flat *= np.sign(inside[5000] @ flat)
    dip = 0.1 * np.max(inside @ flat) / end
    start = flat + np.linalg.lstsq(conditions, [0.0, 0.0, -dip, dip], rcond=None)[0]
    cosine, sine = start[None, :MODES], start[None, MODES:]
    found = solve(
        swinging(omega[None], np.ones((1, WATCHED, MODES)), cosine, sine, end)
    )
    assert found.steps[0] == 1
    top = np.max(inside @ start)
    assert top > 5.0 * dip * end
    np.testing.assert_allclose(found.greatest[0], top, rtol=1e-6)


def test_what_cannot_be_followed_says_so():
    """Not a number, and more steps than allowed; a neighbour is as without them."""
    omega = np.full((3, MODES), 7.0)
    amplitude = np.ones((3, WATCHED, MODES))
    one = np.ones((3, MODES))
    omega[0, 0], omega[1, 0] = np.nan, 1e9
    found = solve(swinging(omega, amplitude, one, one))
    assert [*found.status] == [Status.NOT_FINITE, Status.TOO_MANY_STEPS, Status.DONE]
    assert np.isnan(found.peak[:2]).all()
    alone = solve(swinging(omega[2:], amplitude[2:], one[2:], one[2:]))
    np.testing.assert_array_equal(found.peak[2:], alone.peak)


def coupled(**other):
    """Two masses in a row and what drives them, as one part."""
    entries = [(0, 2), (1, 3), (2, 0), (3, 1), (2, 4)]
    motion = LinearMotion(
        1, 1, np.array(entries), np.array([[3.0, 4.0, -3.0, -4.0, 1.0]]),
        np.array([[0.0, 2.0]]), np.array([[[0.0, 0.0, 0.0, 0.0, 1.0]]]),
        np.ones((1, 1, 2)), np.zeros((1, 1, 1)), np.zeros((1, 1)),
    )  # fmt: skip
    return motion._replace(**other)


def entry(row, column):
    """The last entry, which drives the first speed, in another place."""
    return np.array([(0, 2), (1, 3), (2, 0), (3, 1), (row, column)])


REFUSED = {
    "a position by a driving row": ({"entries": entry(0, 4)}, "entry [[0, 4]]"),
    "a position by a position": ({"entries": entry(1, 0)}, "rows 0 to 1 depend on sp"),
    "across parts": (
        {"parts": 2, "driven": 0, "change": np.zeros((1, 1, 4)),
         "entries": entry(2, 1)},
        "entry [[2, 1]]: both are expected in a part, row % 2",
    ),
    "parts that divide nothing": ({"parts": 2}, "parts 2: a number that divides 5"),
    "no parts": ({"parts": 0}, "parts 0: "),
    "a row too many": ({"entries": entry(5, 0)}, "entry [[5, 0]]: rows 0 to 4 exist"),
    "a row below none": ({"entries": entry(2, -1)}, "entry [[2, -1]]: rows 0 to 4"),
    "an entry twice": ({"entries": entry(2, 0)}, "entry [[2, 0]]: each entry is expec"),
    "one driving row too many": ({"driven": 2}, "change has shape (1, 1, 5): (1"),
    "a rate too few": ({"G": np.ones((1, 4))}, "G has shape (1, 4): (1, 5)"),
    "a sum too many": ({"rest": np.zeros((1, 1, 2))}, "rest has shape (1, 1, 2)"),
    "marks that descend": ({"marks": np.array([[1.0, 0.0]])}, "marks: ascending times"),
}  # fmt: skip


@pytest.mark.parametrize(("other", "words"), REFUSED.values(), ids=REFUSED)
def test_a_motion_that_does_not_fit_is_refused(other, words):
    solve(coupled())
    with pytest.raises(ModelError) as refused:
        solve(coupled(**other))
    assert words in str(refused.value)


def test_samples_outside_the_marks_are_refused():
    with pytest.raises(ModelError, match="samples from 0 to 3 s: times from 0 to 2 s"):
        solve(coupled(), np.array([0.0, 3.0]))


def test_a_driven_mass_has_the_peak_of_its_closed_form():
    """Its position is (1 - cos 3 t)/3: x' = 3 v, v' = -3 x + 1, from rest."""
    found = solve(coupled())
    np.testing.assert_allclose(found.peak, 2.0 / 3.0, rtol=1e-14)


@pytest.mark.parametrize(
    "other", [{"weight": [[[np.nan, 1.0]]]}, {"rest": [[[np.inf]]]}]
)
def test_a_sum_that_is_no_number_fails(other):
    given = {name: np.array(each) for name, each in other.items()}
    found = solve(coupled(**given))
    assert [*found.status] == [Status.NOT_FINITE]
    assert np.isnan(found.peak).all()


def test_a_motion_that_overflows_fails():
    growing = np.array([[3.0, 4.0, 3.0, 4.0, 1.0]])
    found = solve(coupled(G=growing, marks=np.array([[0.0, 1000.0]])))
    assert [*found.status] == [Status.NOT_FINITE]


def test_a_search_without_end_fails():
    """One round is too few for the peak of any step; uncompiled, for its constant."""
    code = (
        "from tests.integrator.test_linear_motion import coupled\n"
        "from tolstat.integrator import linear_motion, linear_peaks\n"
        "print(*linear_motion.solve(coupled()).status)\n"
        "linear_peaks.ROUNDS = 1\n"
        "print(*linear_motion.solve(coupled()).status)"
    )
    found = subprocess.run(
        [sys.executable, "-c", code], env=os.environ | {"NUMBA_DISABLE_JIT": "1"},
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    known = Status.DONE, Status.TOO_MANY_STEPS
    assert found.stdout.split() == [str(int(each)) for each in known]
