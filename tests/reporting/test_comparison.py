"""Two designs of the same machines: differences by hand, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

import tolstat
from tests.store.tampering import resealed
from tolstat.errors import PictureError, RunFileError
from tolstat.reporting.comparison import compared, comparison_table, pair_of
from tolstat.reporting.plain import plain


def test_differences_are_machine_by_machine(mill, linked):
    found = plain(compared(pair_of(mill, linked)))
    difference = linked.column("rod_force_1") - mill.column("rod_force_1")
    each = found["responses"]["rod_force_1"]
    known = np.quantile(difference, 0.95, method="median_unbiased")
    assert each["difference"]["quantiles"]["95 %"]["value"] == pytest.approx(known)
    assert each["difference"]["mean"]["value"] == pytest.approx(difference.mean())
    smaller = int((difference < 0).sum())
    assert each["smaller"]["value"] == smaller / 2200
    low = stats.beta.ppf(0.025, smaller, 2200 - smaller + 1)
    assert each["smaller"]["lower"] == pytest.approx(low)
    assert found["settings"] == {"variant": ["indeterminate", "equalized"]}
    assert found["trials"]["done_in_both"] == 2200
    assert found["interest"][0] == "extra_loss"
    # a link that shares the load never lets the carriage jam
    assert found["responses"]["jam_share"]["larger"]["value"] == 0


def test_a_run_differs_from_itself_by_nothing(mill):
    comparison = compared(pair_of(mill, mill), ["yaw"])
    found = plain(comparison)
    for each in found["responses"].values():
        assert each["difference"]["least"] == each["difference"]["largest"] == 0
        assert each["smaller"]["value"] == each["larger"]["value"] == 0
    assert found["interest"] == ["yaw"] and found["settings"] == {}
    table = comparison_table(comparison)
    assert table.rows[0][0] == "extra_loss" and len(table.heads) == len(table.rows[0])


@pytest.fixture
def other(toy, toy_study, tmp_path):
    """Run the toy study with something else in it."""

    def run(*changes, name="other.h5"):
        text = toy_study.read_text()
        for old, new in changes:
            assert old in text
            text = text.replace(old, new)
        study = tmp_path / "other.toml"
        study.write_text(text)
        return tolstat.run(study, model=toy, output=tmp_path / name, force=True)

    return run


def test_runs_of_other_machines_are_refused(other):
    base = other(name="base.h5")
    with pytest.raises(RunFileError, match="1000 trials and 900"):
        pair_of(base, other(("1000", "900")))
    with pytest.raises(RunFileError, match="part_1 differs in 1000 of 1000 trials"):
        pair_of(base, other(("seed = 1", "seed = 2")))
    with pytest.raises(RunFileError, match=r"angle differs .* first in trial 0 .* rad"):
        pair_of(base, other(("0..360 deg", "0..180 deg")))


def test_differences_that_are_all_alike_are_drawn(toy, tmp_path):
    """But for rounding: no sixty bars have room between them."""
    runs = []
    for name, mode in (("a", "plain"), ("b", "odd")):
        study = {
            "model": "toy", "trials": 400, "seed": 1, "title": "$\\foo{ x",
            "settings": {"mode": mode}, "deviations": {"part": "+-0.1 mm"},
        }  # fmt: skip
        runs.append(tolstat.run(study, model=toy, output=tmp_path / f"{name}.h5"))
    table = runs[1].path
    with resealed(table) as file:
        file["gap"][...] = np.nextafter(file["gap"][...] + 1e-3, 1)
    page = tmp_path / "pair.html"
    tolstat.compare(runs[0].path, table, page, ["gap"])
    assert "mathdefault" not in page.read_text()


def test_machines_that_failed_in_either_are_left_out_and_counted(other):
    base, twice = (
        other(name="base.h5"),
        other(("[limits]", "[settings]\ngain = 4\n[limits]")),
    )
    found = plain(compared(pair_of(base, twice)))
    failed = base.counts["not finite"]
    assert found["trials"]["failed"] == failed > 0
    gap = found["responses"]["gap"]
    assert gap["difference"]["mean"]["value"] == pytest.approx(
        np.nanmean(base.column("gap")), rel=1e-9
    )
    assert found["responses"]["ratio"]["difference"]["largest"] == 0


def test_machines_that_were_chosen_have_no_statistics(toy, tmp_path):
    study = tmp_path / "grid.toml"
    study.write_text(
        'model = "toy"\nsampling = "grid"\n[grid]\npart_1 = ["0 mm", "1 mm"]\n'
    )
    run = tolstat.run(study, model=toy)
    with pytest.raises(PictureError, match="chosen and not drawn"):
        pair_of(run, run)
