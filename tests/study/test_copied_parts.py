"""Measured parts that were pasted again are no parts; equal ones by chance are."""

from __future__ import annotations

import numpy as np
import pytest

from tolstat.errors import StudyError
from tolstat.study.study import load

RNG = np.random.default_rng(5)


def read(folder, parts, *, numbered=False, **keys):
    """Read a study of measured parts, mm; the rows may have numbers of their own."""
    rows = [f"{i};{x}" if numbered else f"{x}" for i, x in enumerate(parts, 1)]
    head = "part;L [mm]" if numbered else "L [mm]"
    (folder / "parts.csv").write_text("\n".join([head, *rows]))
    ring = {"nominal": "12 mm", "data": "parts.csv", "column": "L", **keys}
    study = {
        "model": "dimension_chain", "trials": 10, "seed": 1,
        "settings": {"gap": "box - ring"},
        "links": {"box": "12.2 mm", "ring": ring},
    }  # fmt: skip
    return load(study, folder=folder)


def normal(number, step):
    return np.round(RNG.normal(12, 0.03, number) / step) * step


@pytest.mark.parametrize("numbered", [True, False])
@pytest.mark.parametrize("step", [1e-4, 0.005])
def test_rows_pasted_again_are_refused(tmp_path, numbered, step):
    parts = [f"{x:.4f}" for x in normal(30, step)]
    with pytest.raises(StudyError, match=r"line 32 and the .* after it have the same"):
        read(tmp_path, 10 * parts, numbered=numbered)
    with pytest.raises(StudyError, match="have the same cells as"):
        read(tmp_path, [*parts, "12.3", *parts], numbered=numbered)
    allowed = read(tmp_path, 10 * parts, numbered=numbered, repeats=True)
    assert not any("copy" in sentence for sentence in allowed.deviating.warnings)
    read(tmp_path, parts, numbered=numbered)


@pytest.mark.parametrize("numbered", [True, False])
def test_equal_parts_by_chance_are_taken(tmp_path, numbered):
    """A coarse gauge, one that drifts slowly, and run-outs, a third of them zero."""
    for _ in range(20):
        read(tmp_path, normal(400, 0.02), numbered=numbered)
    drift = 12 + np.round(np.linspace(0, 0.05, 300) + RNG.normal(0, 2e-3, 300), 2)
    read(tmp_path, drift, numbered=numbered)
    zeros = np.where(RNG.random(300) < 1 / 3, 12, normal(300, 0.005))
    read(tmp_path, zeros, numbered=numbered)


def test_an_outlier_or_two_cavities_make_no_copies_of_equal_parts(tmp_path):
    """A gauge of 1 um, 60 parts with a sigma of 4 um: by chance many are equal."""
    parts = np.random.default_rng(5).normal(12, 0.004, 60)
    outlier, cavities = parts.copy(), parts + np.repeat([0, 0.05], 30)
    outlier[17] = 12.05
    for sizes in (outlier, cavities):
        study = read(tmp_path, [f"{x:.3f}0" for x in sizes], numbered=True)
        assert not study.deviating.warnings
    copied = [f"{x:.6f}" for x in (*cavities, *cavities[3:27:4])]
    (warning,) = read(tmp_path, copied, numbered=True).deviating.warnings
    assert "line 62 has the same cells as" in warning and "(but for part)" in warning


def test_a_number_of_its_own_makes_no_copy_of_an_equal_part(tmp_path):
    parts = [f"{x:.4f}" for x in normal(40, 1e-4)]
    for rows in ([*parts, parts[3]], range(12, 17)):  # sizes may count, too
        warnings = read(tmp_path, [*rows], numbered=True).deviating.warnings
        assert not any("copy" in sentence for sentence in warnings)


def test_another_column_that_cannot_be_read_is_no_fault(tmp_path):
    rows = [f"{i};{12 + i * i % 7 / 100:.2f};{i % 5} in" for i in range(1, 40)]
    (tmp_path / "mixed.csv").write_text("\n".join(["part;L [mm];w [mm]", *rows]))
    ring = {"nominal": "12 mm", "data": "mixed.csv", "column": "L"}
    study = {
        "model": "dimension_chain", "trials": 10, "seed": 1,
        "settings": {"gap": "ring"}, "links": {"ring": ring},
    }  # fmt: skip
    assert load(study, folder=tmp_path).deviating.measured
