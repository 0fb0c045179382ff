"""A drive found from its modes: the paper's Table 1, and tables of known drives."""

from __future__ import annotations

import numpy as np
import pytest

import tolstat
from tests.machines import rolling_block_reference as known
from tolstat.errors import ModelError
from tolstat.machines.rolling_block.modes import modes_of, unit_shapes
from tolstat.machines.rolling_block.settings import INERTIAS, STIFFNESSES

ROUND = np.array([*INERTIAS, *STIFFNESSES])


def unknowns(found):
    return np.concatenate([found.inertias, found.stiffnesses])


def sigmas(found):
    return np.concatenate([found.inertia_sigmas, found.stiffness_sigmas])


def table_of(drive, digits=(2, 4)):
    """Frequencies and shapes of a drive as a table prints them."""
    modes = modes_of(drive[None, :9], drive[None, 9:])
    hz = np.round(modes.omega[0] / (2 * np.pi), digits[0])
    return hz, np.round(unit_shapes(modes.phi)[0], digits[1])


def test_table_1_as_printed():
    """The drive to 0.12 %, and the misprint named."""
    found = tolstat.identify_drive(known.TABLE_1_HZ, known.TABLE_1)
    assert found.inertias.sum() == pytest.approx(680.0)
    np.testing.assert_allclose(unknowns(found), ROUND, rtol=1.2e-3)
    (misprint,) = found.contradictions
    assert (misprint.mode, misprint.mass, misprint.given) == (1, 2, 0.130)
    assert misprint.expected == pytest.approx(-0.130, abs=5e-4)
    assert misprint.certain
    assert str(misprint) == (
        "mode 1, mass 2: 0.13 is given, the rest of the table asks for -0.1296"
    )


def test_table_1_corrected():
    """The free fit of an independent implementation, to its printed digits."""
    found = tolstat.identify_drive(known.TABLE_1_HZ, known.CORRECTED)
    assert found.contradictions == ()
    Q = [300.081, 29.985, 29.979, 79.963, 59.977, 50.003, 50.003, 40.004, 40.004]
    C = [8.0018, 7.9905, 6.9954, 6.9933, 1.9991, 1.9991, 1.0001, 1.0001]
    np.testing.assert_allclose(found.inertias, Q, atol=2e-3)
    np.testing.assert_allclose(found.stiffnesses / 1e6, C, atol=3e-4)
    share = sigmas(found) / unknowns(found)
    assert (share > 4e-4).all() and (share < 1.05e-3).all()
    assert abs(found.frequencies - known.TABLE_1_HZ).max() < 0.05
    assert abs(found.mode_shapes - known.CORRECTED).max() < 6e-4
    # what is found can be asked like any drive
    settings = {"inertias": found.inertias, "stiffnesses": found.stiffnesses}
    answer = tolstat.evaluate("rolling_block", None, {**settings, "horizon": 0.01})
    hz = [answer[f"frequency_{r}"].iloc[0] for r in range(1, 9)]
    np.testing.assert_allclose(hz, found.frequencies, rtol=1e-9)


def test_the_uncertainty_is_what_rounding_does():
    """Many drives, their tables rounded: errors as large as is said."""
    rng = np.random.default_rng(6)
    ratios = []
    for _ in range(25):
        drive = ROUND * np.exp(0.2 * rng.standard_normal(17))
        found = tolstat.identify_drive(
            *table_of(drive), total_inertia=drive[:9].sum(),
            frequency_resolution=0.01, shape_resolution=1e-4,
        )  # fmt: skip
        assert found.contradictions == ()
        ratios.append((unknowns(found) - drive) / sigmas(found))
    assert 0.85 < np.std(ratios) < 1.15
    assert np.max(np.abs(ratios)) < 5


# rows of the table from 1 (0: frequency), modes from 1; nothing else of the symmetric
# drive tells how much each of two stands alike has
ALONE = {(8, 3): "Q8, Q9, C58, C59", (9, 3): "Q8, Q9, C58, C59",
         (6, 4): "Q6, Q7, C46, C47", (7, 4): "Q6, Q7, C46, C47"}  # fmt: skip


def named_rightly(drive, row, mode, change, **digits):
    """Plant an error; assert that it is named, and the drive found in spite of it."""
    table = np.vstack(table_of(drive, (1, 3)))
    right = table[row, mode - 1]
    table[row, mode - 1] += change
    given = {"total_inertia": drive[:9].sum()}
    found = tolstat.identify_drive(table[0], table[1:], **given, **digits)
    (named,) = found.contradictions
    assert (named.mode, named.mass, named.certain) == (mode, row, True)
    asked = abs(named.expected - right)
    assert asked < (0.4 if row == 0 else 0.01)
    assert (abs(unknowns(found) - drive) < 5 * sigmas(found)).all()


@pytest.mark.parametrize("mode", range(1, 9))
def test_a_wrong_frequency_is_named(mode):
    """Of local modes, and of the last one, which few other numbers check."""
    for change in (-3.0, -0.5, 1.0):
        named_rightly(ROUND, 0, mode, change)


@pytest.mark.parametrize("mode", range(1, 9))
def test_a_wrong_part_of_a_shape_is_named(mode):
    """A sign, or where there is next to nothing, something."""
    parts = table_of(ROUND, (1, 3))[1][:, mode - 1]
    for row in range(1 + mode % 3, 10, 3):
        if (row, mode) not in ALONE:
            part = parts[row - 1]
            named_rightly(ROUND, row, mode, -2 * part if abs(part) > 0.05 else 0.3)


@pytest.mark.parametrize("seed", range(8))
def test_a_planted_error_is_named_in_any_drive(seed):
    rng = np.random.default_rng(seed)
    drive = ROUND * np.exp(0.15 * rng.standard_normal(17))
    row, mode = int(rng.integers(10)), int(rng.integers(1, 9))
    change = rng.choice([-1.0, 1.0]) * (1.5 if row == 0 else rng.uniform(0.1, 0.5))
    named_rightly(drive, row, mode, change)


def test_two_errors_are_named():
    table = np.vstack([known.TABLE_1_HZ, known.CORRECTED])
    table[0, 2], table[4, 0] = 26.2, 0.617
    found = tolstat.identify_drive(table[0], table[1:])
    assert [c[:2] for c in found.contradictions] == [(1, 4), (3, 0)]
    assert (abs(unknowns(found) - ROUND) < 5 * sigmas(found)).all()


@pytest.mark.parametrize(("row", "mode"), list(ALONE))
def test_what_nothing_checks_is_said(row, mode):
    """A wrong sign cannot be told from its neighbour's; a wrong size is not seen."""
    shapes = known.CORRECTED.copy()
    here = row - 1, mode - 1
    shapes[here] *= 1.4
    found = tolstat.identify_drive(known.TABLE_1_HZ, shapes)
    assert found.contradictions == ()
    alone = {(int(i), int(r) + 1) for i, r in np.argwhere(np.isinf(found.noticed))}
    assert alone == set(ALONE)
    shapes[here] *= -1
    both = f"mode {mode}, mass . or mode {mode}, mass .: .*"
    with pytest.raises(ModelError, match=f"{both}not determine {ALONE[row, mode]};"):
        tolstat.identify_drive(known.TABLE_1_HZ, shapes)
    shapes[here] = np.nan
    with pytest.raises(ModelError, match=f"does not determine {ALONE[row, mode]}:"):
        tolstat.identify_drive(known.TABLE_1_HZ, shapes)


@pytest.mark.parametrize(
    ("modes", "what"),
    [
        ([1, 2, 3, 5, 6, 7, 8], "Q6, Q7, C46, C47"),
        ([1, 2, 3, 5, 7, 8], "Q6, Q7, C46, C47"),
        ([1, 2, 4, 5, 6, 7, 8], "Q8, Q9, C58, C59"),
        ([2, 5, 6, 7, 8], "Q6, Q7, Q8, Q9, C46, C47, C58, C59"),
        ([1, 2, 3], "Q3, Q6, Q7, C46, C47"),
        ([1, 2, 3, 8], "Q6, Q7, C46, C47"),
        ([4, 6], "Q1, .*C59"),
    ],
)
def test_modes_that_leave_something_open(modes, what):
    """The numbers are right, and none is blamed."""
    hz, shapes = table_of(ROUND, (1, 3))
    chosen = np.array(modes) - 1
    with pytest.raises(ModelError, match=f"^the table does not determine {what}:"):
        tolstat.identify_drive(hz[chosen], shapes[:, chosen])


def test_errors_too_small_to_be_named_are_said():
    """Just above the least that is noticed the number is named, just below it is not.

    Where another one explains it as well, both are named, and neither is certain.
    """
    hz, shapes = table_of(ROUND, (1, 3))
    clean = tolstat.identify_drive(hz, shapes)
    least = clean.noticed
    assert np.nanmin(least[0]) > 0.15 and np.nanmin(least[1:]) >= 0.0015 * (1 - 1e-9)
    for row, mode in ((0, 8), (3, 8), (1, 1)):
        table = np.vstack([hz, shapes])
        asked = np.vstack([clean.frequencies, clean.mode_shapes])[row, mode - 1]
        step = least[row, mode - 1]
        found = []
        for change in (0.5 * step, 1.5 * step):
            table[row, mode - 1] = asked + change
            answer = tolstat.identify_drive(table[0], table[1:])
            found.append([each[:2] for each in answer.contradictions])
            if len(found[-1]) > 1:
                assert not any(each.certain for each in answer.contradictions)
        assert found[0] == [] and (mode, row) in found[1]


def test_scale_signs_and_order_of_the_table_are_free():
    hz, shapes = known.TABLE_1_HZ, known.CORRECTED
    usual = tolstat.identify_drive(hz, shapes)
    order = [4, 0, 7, 2, 1, 3, 6, 5]
    other = tolstat.identify_drive(hz[order], -shapes[:, order], total_inertia=68.0)
    np.testing.assert_allclose(unknowns(other), 0.1 * unknowns(usual), rtol=1e-6)
    np.testing.assert_allclose(
        other.mode_shapes, -usual.mode_shapes[:, order], atol=1e-7
    )


def test_what_is_not_known_may_be_left_out():
    shapes = known.CORRECTED.copy()
    shapes[0, 1] = shapes[5, 4] = shapes[8, 6] = np.nan
    found = tolstat.identify_drive(known.TABLE_1_HZ, shapes)
    np.testing.assert_allclose(unknowns(found), ROUND, rtol=2.5e-3)
    assert found.contradictions == ()
    assert found.mode_shapes[0, 1] == pytest.approx(0.073, abs=1e-3)
    fewer = tolstat.identify_drive(known.TABLE_1_HZ[1:7], known.CORRECTED[:, 1:7])
    assert (abs(unknowns(fewer) - ROUND) < 5 * sigmas(fewer)).all()


@pytest.mark.parametrize(
    ("hz", "shapes", "given", "words"),
    [
        (known.TABLE_1_HZ[:1], known.TABLE_1[:, :1], {}, "2 to 8 are expected"),
        (known.TABLE_1_HZ, known.TABLE_1[:8], {}, "9 rows of 8 .*these are 8 x 8"),
        (known.TABLE_1_HZ, known.TABLE_1.T, {}, "these are 8 x 9"),
        (-known.TABLE_1_HZ, known.TABLE_1, {}, "numbers from 1e-09 to"),
        ("abc", known.TABLE_1, {}, "frequencies: real numbers"),
        (known.TABLE_1_HZ, known.TABLE_1 + 1e-3j, {}, "of a complex shape"),
        (known.TABLE_1_HZ, [[1.0], [1.0, 2.0]], {}, "rows of equal length"),
        (known.TABLE_1_HZ, 0 * known.TABLE_1, {}, "any scale will do"),
        (known.TABLE_1_HZ, known.TABLE_1, {"total_inertia": -1.0}, "a number from"),
        (known.TABLE_1_HZ, known.TABLE_1, {"shape_resolution": "1"}, "a number from"),
        (known.TABLE_1_HZ[::-1], known.TABLE_1, {}, "no drive of this structure"),
    ],
)
def test_wrong_tables(hz, shapes, given, words):
    with pytest.raises(ModelError, match=words):
        tolstat.identify_drive(hz, shapes, **given)
