"""Pages of runs that are large, measured, correlated, in part, or no sample."""

from dataclasses import replace

import numpy as np
import pytest

import tolstat
from tests.answers.explore.node import data_of, readings
from tests.conftest import ROOT
from tolstat.answers.explore import page_trials
from tolstat.errors import QuestionError

MM = 1e-3


def chain(**more):
    return {
        "model": "dimension_chain", "trials": 4000, "seed": 5,
        "settings": {"gap": "hypot(H - b_1 - b_2, 3*d)"},
        "links": {
            "H": {"nominal": "50 mm", "tolerance": "+-0.2 mm"},
            "d": {"nominal": "0.5 mm", "tolerance": "+-0.1 mm"},
            "b_1": "20 mm", "b_2": "29 mm",
        },
        "deviations": {"b": {"tolerance": "-0.2..0 mm", "common": True}},
        "limits": {"gap": "1.6..2.1 mm"}, **more,
    }  # fmt: skip


@pytest.mark.parametrize(
    ("entries", "deviations"),
    [
        ({"b": {"half": 0.05 * MM}}, {"b": "-0.15..-0.05 mm"}),
        ({"d": {"nominal": 0.55 * MM}}, {"d": {"nominal": "0.55 mm"}}),
        ({"H": {"half": 0.3 * MM, "shift": 0.05 * MM}},
         {"H": {"tolerance": "+-0.3 mm", "nominal_shift": "0.05 mm"}}),
    ],
)  # fmt: skip
@pytest.mark.parametrize("sampling", ["random", "sobol", "latin"])
def test_batches_correlations_and_formulas(entries, deviations, sampling, tmp_path):
    trials = 4096 if sampling == "sobol" else 4000
    run = tolstat.run(
        chain(correlation={"H": {"d": 0.5}}, sampling=sampling, trials=trials)
    )
    (reading,) = readings(tolstat.explore(run), tmp_path, [{"entries": entries}])
    answer = tolstat.what_if(run, deviations, evaluate=True).responses["gap"].scenario
    gap = reading["responses"]["gap"]
    share = answer.limited.yields.fraction_out_of_limit.value
    assert 0 < share < 1
    assert gap["share"] == pytest.approx(share, abs=3 / trials)
    assert gap["mean"] == pytest.approx(answer.mean.value, abs=2e-4 * gap["sigma"])
    if sampling != "random":  # intervals of replicates are those of the run alone
        assert gap["verdict"] == "no interval"


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    path = tmp_path_factory.mktemp("measured") / "covers.h5"
    study = ROOT / "runs" / "measured-parts.toml"
    return tolstat.run(study, trials=5000, output=path)


def test_measured_parts_stay(measured, tmp_path):
    explored = tolstat.explore(measured)
    cover = next(e for e in data_of(explored)["entries"] if e["name"] == "cover")
    assert cover["reason"] == "measured parts have no tolerance to change"
    change = {"entries": {"seal": {"half": 0.12 * MM}}}
    (reading,) = readings(explored, tmp_path, [change])
    answer = tolstat.what_if(measured, {"seal": "+-0.12 mm"}).responses["gap"].scenario
    gap = reading["responses"]["gap"]
    assert gap["mean"] == pytest.approx(answer.mean.value, abs=1e-3 * gap["sigma"])
    assert gap["sigma"] == pytest.approx(answer.sigma.value, rel=1e-3)


def test_a_large_run_has_each_trial_out_of_limit(monkeypatch, tmp_path):
    path = tmp_path / "large.h5"
    run = tolstat.run(ROOT / "runs" / "stack-up.toml", trials=60_000, output=path)
    explored = tolstat.explore(run)
    data = data_of(explored)
    out = run.beyond("gap")
    assert data["rows"] == 60_000 or data["times"]
    monkeypatch.setattr(page_trials, "MOST_BYTES", 120_000)
    explored = tolstat.explore(run)
    data = data_of(explored)
    assert data["rows"] < 12_000
    change = {"entries": {"housing": {"half": 0.15 * MM}}}
    drawing, wider = readings(explored, tmp_path, [{}, change])
    assert drawing["responses"]["gap"]["share"] == out.mean()
    assert drawing["responses"]["gap"]["count"] == out.sum()
    answer = tolstat.what_if(run, {"housing": "+-0.15 mm"}).responses["gap"].scenario
    share = answer.limited.yields.fraction_out_of_limit.value
    lower, upper = wider["responses"]["gap"]["range"]
    assert lower < share < upper
    assert upper - lower < share


def test_a_run_in_part_says_so():
    run = tolstat.run(chain())
    status = np.where(np.arange(run.trials) < 2073, run.status, 0).astype(np.uint8)
    part = replace(run, columns={**run.columns, "status": status}, complete=False)
    page = tolstat.explore(part).html()
    assert "2073 of 4000 trials, evaluated again" in page
    assert "The verdicts are of a run in part" in page
    whole = tolstat.explore(run).html()
    assert " of 4000 trials" not in whole
    assert "in part" not in whole


def test_most_trials_out_of_limit_are_a_sample_like_all(monkeypatch):
    run = tolstat.run(chain(limits={"gap": "1.60..1.61 mm"}))
    monkeypatch.setattr(page_trials, "MOST_BYTES", 8_000)
    data = data_of(tolstat.explore(run))
    assert data["times_ends"] == pytest.approx([4000 / data["rows"]] * 2)


def test_grids_are_no_sample():
    grid = {"H": {"from": "-0.1 mm", "to": "0.1 mm", "points": 3}}
    study = chain(grid=grid, sampling="grid")
    for key in ("seed", "trials"):
        study.pop(key)
    study["links"]["H"].pop("tolerance")
    study["links"]["d"].pop("tolerance")
    study.pop("deviations")
    with pytest.raises(QuestionError, match="no sample"):
        tolstat.explore(tolstat.run(study))


def test_a_run_without_limits_takes_typed_ones(tmp_path):
    run = tolstat.run({k: x for k, x in chain().items() if k != "limits"})
    change = {"limits": {"gap": {"lower": 1.6 * MM}}}
    (reading,) = readings(tolstat.explore(run), tmp_path, [change])
    expected = float(np.mean(run.column("gap") < 1.6 * MM))
    assert reading["responses"]["gap"]["share"] == pytest.approx(expected, abs=1e-3)
    assert "--limit 'gap >= 1.6 mm'" in reading["command"]


def test_slopes_are_not_shown_where_the_gap_turns(tmp_path):
    path = tmp_path / "position.h5"
    run = tolstat.run(ROOT / "runs" / "position.toml", trials=2000, output=path)
    data = data_of(tolstat.explore(run))
    assert {r["name"]: r["turning"] for r in data["responses"]} == {
        "at_mmc": "x, y", "regardless": "x, y",
    }  # fmt: skip
    linear = data_of(tolstat.explore(tolstat.run(chain())))
    assert linear["responses"][0]["turning"] == ""


def test_cases_are_evaluated_and_a_limit_of_all_moves_as_one(tmp_path):
    cases = {"cold": {"H": "49.95 mm"}, "warm": {"d": "0.6 mm"}}
    limits = {"gap": {"limit": "1.6..2.1 mm", "yield": "99 %"}}
    study = chain(cases=cases, limits=limits, trials=1000)
    run = tolstat.run(study, output=tmp_path / "cases.h5")
    explored = tolstat.explore(run)
    data = data_of(explored)
    assert data["evaluated"]
    sized = {entry["name"]: entry["sized"] for entry in data["entries"]}
    assert not (sized["H"] or sized["d"])  # a case replaces their nominal values
    change = {
        "entries": {"H": {"half": 0.1 * MM, "shift": 0.02 * MM}},
        "limits": {"gap_at_warm": {"upper": 2.2 * MM}},
    }
    drawing, reading = readings(explored, tmp_path, [{}, change])
    answer = tolstat.what_if(
        run, {"H": {"tolerance": "+-0.1 mm", "nominal_shift": "0.02 mm"}},
        limits={"gap": "1.6..2.2 mm"}, evaluate=True,
    )  # fmt: skip
    for name, gap in reading["responses"].items():
        scenario = answer.responses[name].scenario
        share = scenario.limited.yields.fraction_out_of_limit.value
        assert gap["share"] == pytest.approx(share, abs=2e-3)
        assert gap["mean"] == pytest.approx(
            scenario.mean.value, abs=1e-3 * gap["sigma"]
        )
        assert drawing["responses"][name]["mean"] != gap["mean"]
    assert "limits.gap = " in reading["toml"] and "yield" in reading["toml"]
    assert "--limit 'gap = 1.6..2.2 mm'" in reading["command"]
    assert reading["same"]
