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


@pytest.mark.parametrize(
    ("row", "mode", "change"),
    [(1, 1, -1.0), (9, 3, -1.0), (3, 8, 1.1), (2, 7, 1.03), (0, 5, 0.9), (0, 1, 1.2)],
)
def test_a_planted_error_is_named(row, mode, change):
    """Row 0 holds the frequencies; the drive is found in spite of it."""
    drive = ROUND * np.exp(0.1 * np.random.default_rng(row).standard_normal(17))
    hz, shapes = table_of(drive)
    table = np.vstack([hz, shapes])
    right = table[row, mode - 1]
    table[row, mode - 1] = right * change
    found = tolstat.identify_drive(
        table[0], table[1:], total_inertia=drive[:9].sum(),
        frequency_resolution=0.01, shape_resolution=1e-4,
    )  # fmt: skip
    (named,) = found.contradictions
    assert (named.mode, named.mass) == (mode, row)
    assert named.expected == pytest.approx(right, abs=0.02 if row == 0 else 2e-4)
    assert (abs(unknowns(found) - drive) < 6 * sigmas(found)).all()


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
        (-known.TABLE_1_HZ, known.TABLE_1, {}, "numbers above 0 Hz"),
        (known.TABLE_1_HZ, 0 * known.TABLE_1, {}, "not all of them 0"),
        (known.TABLE_1_HZ, known.TABLE_1, {"total_inertia": -1.0}, "above 0 is expec"),
        (known.TABLE_1_HZ[2:4], known.CORRECTED[:, 2:4], {}, "does not determine"),
        (known.TABLE_1_HZ[::-1], known.TABLE_1, {}, "no drive of this structure"),
    ],
)
def test_wrong_tables(hz, shapes, given, words):
    with pytest.raises(ModelError, match=words):
        tolstat.identify_drive(hz, shapes, **given)
