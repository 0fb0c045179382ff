"""Assumptions and integration error in a run file."""

from __future__ import annotations

import h5py
import numpy as np
import pytest
import tomli_w

import tolstat
from tolstat.store.assumed import SCORES


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("audit")
    study = folder / "study.toml"
    study.write_text(
        'model = "stand"\ntrials = 250\nseed = 3\n[deviations]\n'
        'rod_length = { tolerance = "+-1.2 mm", common = true }\n'
        'friction = { tolerance = "-20..+40 %", distribution = "triangular" }\n'
        'crank_radius_1 = { distribution = "constant", value = "0.1 mm" }\n'
    )
    return tolstat.run(study)


def test_audit_and_assumptions_in_plain_h5py(run):
    with h5py.File(run.path) as file:
        audit = file["audit"]
        trials = audit["trials"][:]
        assert audit["settings"].attrs["rtol"] == pytest.approx(1e-6)
        at_random = trials[audit["at_random"][:] == 1]
        assert list(at_random // 100) == [0, 1, 2]
        largest = np.argmax(file["rod_force_1"][:])
        by_force = audit["chosen_by/rod_force_1"]
        assert by_force[:][trials == largest] == by_force.attrs["flag_masks"][2]
        assert by_force.attrs["flag_meanings"].split()[2] == "spread"
        assert (audit["status"][:] == 1).all()
        difference = audit["responses/rod_force_1"][:] - file["rod_force_1"][:][trials]
        assert 0 < np.abs(difference).max() < 1e-2 * 1e5
        assert audit["responses/rod_force_1"].attrs["units"] == "N"
        assert file["rod_length_1"].attrs["part"] == "rods"
        assert "part" not in file["friction"].attrs


def test_assumptions_in_plain_h5py(run):
    """One table, whose scale names the contributors that deviate."""
    with h5py.File(run.path) as file:
        table = file["assumed"]
        names = list(table["contributor"].asstr())
        assert "crank_angle_1" not in names
        rods, friction = names.index("rod_length_1"), names.index("friction")
        tolerance = table["tolerance_lower"][rods], table["tolerance_upper"][rods]
        np.testing.assert_allclose(tolerance, (-1.2e-3, 1.2e-3))
        words = table["words"].asstr()
        assert words[rods] == "normal, +-1.2 mm, cp 1, all parts alike"
        assert words[friction] == "triangular, -20..+40 %"
        assert table["entry"].asstr()[rods] == "rod_length"
        assert list(table["common"][[rods, friction]]) == [1.0, 0.0]
        quantiles = table["quantiles"][rods]
    np.testing.assert_allclose(quantiles, SCORES * 0.4e-3, rtol=2e-3, atol=1e-12)


PARTS = np.array([-40, -30, -10, 5, 6, 10, 20, 30, 50, 70]) * 1e-6


def test_assumptions_are_values(tmp_path):
    """Centre, shift of the nominal, places and measured parts need no study text."""
    links = {
        "a": {"tolerance": "-0.1..0.3 mm", "nominal_shift": "0.05 mm"},
        "b": {"tolerance": "+-0.1 mm", "distribution": "triangular", "mode": "0 mm"},
        "c": {"tolerance": "0..0.3 mm", "distribution": "weibull", "shape": 2},
        "d": {"data": "parts.csv", "column": "d"},
        "e": {"data": "parts.csv", "column": "d", "fit": "normal"},
        "f": {"distribution": "constant", "value": "0.2 mm"},
    }
    rows = "\n".join(f"{x:.9g}" for x in PARTS)
    (tmp_path / "parts.csv").write_text(f"d [m]\n{rows}\n")
    study = {
        "model": "dimension_chain", "trials": 20, "seed": 1,
        "settings": {"gap": "a + b + c + d + e + f"},
        "links": {n: {"nominal": "9 mm", **keys} for n, keys in links.items()},
    }  # fmt: skip
    (tmp_path / "study.toml").write_text(tomli_w.dumps(study))
    assumed = tolstat.run(tmp_path / "study.toml").assumed
    micrometres = {name: round(part.centre * 1e6, 6) for name, part in assumed.items()}
    del micrometres["e"]  # of its fit
    assert micrometres == {"a": 150, "b": 0, "c": 0, "d": 15, "f": 200}
    assert assumed["a"].tolerance == pytest.approx((-0.05e-3, 0.35e-3))
    assert assumed["a"].nominal_shift == pytest.approx(0.05e-3)
    assert assumed["a"].changed_zone(0.0, 0.5) == pytest.approx((0, 0.2e-3))
    assert [name for name, part in assumed.items() if part.has_places] == ["b"]
    assert [part.parts for part in assumed.values()] == [0, 0, 0, 10, 10, 0]
    with_tolerance = [name for name, part in assumed.items() if part.has_tolerance]
    assert with_tolerance == ["a", "b", "c"]
    assert np.unique(assumed["d"].quantiles) == pytest.approx(PARTS)


@pytest.mark.parametrize(
    ("other", "same"),
    [
        ("+-0.10 mm", True), ("+-100 um", True), ("js12", False), ("+-0.11 mm", False),
        ("-0.1..+0.1 mm", True), ({"tolerance": "+-0.1 mm", "cp": 1}, True),
        ({"tolerance": "+-0.1 mm", "cp": 1.1}, False),
        ({"tolerance": "+-0.2 mm", "cp": 2}, False),  # half of it is another zone
    ],
)  # fmt: skip
def test_equal_distributions_are_equal_however_they_are_written(other, same):
    keys = other if isinstance(other, dict) else {"tolerance": other}
    run = tolstat.run({
        "model": "dimension_chain", "trials": 20, "seed": 1,
        "settings": {"gap": "A - B"},
        "links": {
            "A": {"nominal": "9 mm", "tolerance": "+-0.1 mm"},
            "B": {"nominal": "9 mm", **keys},
        },
    })  # fmt: skip
    first, second = run.assumed.values()
    assert (first.distribution == second.distribution) is same


def test_audit_and_assumptions_of_a_run(run):
    assert (
        run.audited.settings == pytest.approx({"rtol": 1e-6, "max_step": 2.5e-4})
        and np.count_nonzero(run.audited.at_random) == 3
    )
    assert set(run.audited.responses) == {each.name for each in run.responses}
    assert run.assumed["rod_length_2"].entry == "rod_length"
    assert set(run.assumed) == {
        "rod_length_1", "rod_length_2", "friction", "crank_radius_1",
    }  # fmt: skip
    parts = {each.name: each.part for each in run.contributors}
    assert parts["runout_phase_7"] == "gears" and parts["guide_clearance"] == ""


def test_a_run_that_was_stopped_has_no_audit_yet(tmp_path, monkeypatch):
    from tolstat.execution.execute import execute
    from tolstat.execution.workers.block_scheduler import Workers
    from tolstat.study.study import load

    # planning may take long on a machine with much to do
    monkeypatch.setattr("tolstat.execution.workers.block_scheduler.PATIENCE", 60.0)
    asked = load("runs/khpt75.toml", trials=300)
    with Workers(stopping=lambda: True) as crew:
        run = execute(asked, tmp_path / "stopped.h5", crew)
    assert run.audited is None and run.counts["not run"] == 300
    assert run.diagnostics.missing == "the run did not come to its end"
