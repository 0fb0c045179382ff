"""The page of a chain: its formula evaluated again, as what-if does."""

import shlex
import tomllib

import numpy as np
import pytest
from click.testing import CliRunner

import tolstat
from tests.answers.explore.node import data_of, readings, rows_of
from tests.conftest import ROOT
from tolstat.cli.main import main

MM = 1e-3
SCENARIOS = [
    ({}, {}, None),
    ({"housing": {"half": 0.06 * MM}}, {"housing": "+-0.06 mm"}, None),
    (
        {"housing": {"nominal": 120.257 * MM}},
        {"housing": {"nominal": "120.257 mm"}},
        None,
    ),
    (
        {"shaft": {"grade": "h6"}, "bearing_1": {"shift": -0.01 * MM}},
        {"shaft": "h6", "bearing_1": {"shift": "-=0.01 mm"}},
        None,
    ),
    (
        {
            "housing": {"kind": "triangular", "half": 0.15 * MM, "shift": 0.02 * MM},
            "bearing_2": {"kind": "screened"},
        },
        {
            "housing": {
                "tolerance": "+-0.15 mm",
                "distribution": "triangular",
                "nominal_shift": "0.02 mm",
            },
            "bearing_2": {
                "tolerance": "-0.12..0 mm",
                "distribution": "truncated_normal",
                "outside": "screened",
            },
        },
        {"gap": "0.21..0.65 mm"},
    ),
]
LIMITS = {"gap": {"lower": 0.21 * MM, "upper": 0.65 * MM}}


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("explored")
    return tolstat.run(ROOT / "runs" / "stack-up.toml", output=folder / "stack up.h5")


@pytest.fixture(scope="module")
def explored(run):
    return tolstat.explore(run)


@pytest.fixture(scope="module")
def found(explored, tmp_path_factory):
    changes = [
        {"entries": entries, "limits": LIMITS if limits else {}}
        for entries, _, limits in SCENARIOS
    ]
    return readings(explored, tmp_path_factory.mktemp("node"), changes)


@pytest.mark.parametrize("case", range(1, len(SCENARIOS)))
def test_numbers_are_those_of_what_if(run, found, case):
    _, deviations, limits = SCENARIOS[case]
    summary = (
        tolstat.what_if(run, deviations, limits=limits, evaluate=True)
        .responses["gap"]
        .scenario
    )
    gap = found[case]["responses"]["gap"]
    share, lower, upper, _ = summary.limited.yields.fraction_out_of_limit
    # a trial beside a limit may change sides: tables are interpolated
    assert gap["share"] == pytest.approx(share, abs=2.1e-4)
    assert gap["range"] == pytest.approx([lower, upper], abs=4e-4)
    assert gap["verdict"] == summary.limited.yields.verdict
    assert gap["mean"] == pytest.approx(summary.mean.value, abs=2e-4 * gap["sigma"])
    assert gap["sigma"] == pytest.approx(summary.sigma.value, rel=2e-3)
    assert gap["moments"] == pytest.approx(summary.limited.moments.ppk.value, rel=2e-3)
    ppk = summary.limited.equivalent_ppk
    assert gap["ppk"][1:] == pytest.approx([ppk.lower, ppk.upper], rel=0.02)


def test_the_drawing_is_read_as_the_run(run, found):
    yields = tolstat.report(run).responses["gap"].limited.yields
    gap = found[0]["responses"]["gap"]
    out = yields.fraction_out_of_limit
    assert [gap["share"], *gap["range"]] == pytest.approx([*out[:3]], rel=1e-12)
    assert gap["stored"]
    assert gap["verdict"] == yields.verdict


def test_the_verdict_is_that_of_all_limits(tmp_path):
    path = tmp_path / "gaps.h5"
    run = tolstat.run(ROOT / "runs" / "gaps.toml", trials=10_000, output=path)
    housing = {"nominal": 120.29 * MM, "half": 0.05 * MM}
    both = {"housing": housing, "ring": {"nominal": 2.05 * MM}}
    first, second = readings(
        tolstat.explore(run), tmp_path, [{"entries": both}, {"entries": {}}]
    )
    each = {name: r["verdict"] for name, r in first["responses"].items()}
    assert each["play"] == "met"
    assert each["ring_play"] == "not met"
    assert first["verdict"] == "not met"
    assert first["deciding"] == ["ring_play"]
    assert first["limited"] == 3
    assert second["deciding"] == ["play"]
    summaries = tolstat.report(run).responses
    for name, reading in second["responses"].items():
        assert reading["normal"] is summaries[name].normal_tails


def test_worst_case_and_root_sum_square_are_those_of_the_run(run, found):
    numbers = {number.name: number.value for number in run.numbers}
    stack = found[0]["stack"]
    assert stack["worst"] == pytest.approx(
        [numbers["worst_min"], numbers["worst_max"]], rel=1e-9
    )
    assert stack["rss"] == pytest.approx(
        [numbers["rss_mean"], numbers["rss_sigma"]], rel=1e-6
    )


@pytest.mark.parametrize("case", range(1, len(SCENARIOS)))
def test_copied_commands_agree(run, found, case, tmp_path):
    command = shlex.split(found[case]["command"])
    assert command[:3] == ["tolstat", "what-if", str(run.path)]
    table = tmp_path / "answer.csv"
    done = CliRunner().invoke(main, [*command[1:], "-o", str(table)])
    assert done.exit_code == 0, done.output
    (row,) = rows_of(table)
    gap = found[case]["responses"]["gap"]
    assert float(row["fraction out of limit [ppm]"]) == pytest.approx(
        1e6 * gap["share"], abs=210
    )


@pytest.mark.parametrize("case", range(1, len(SCENARIOS)))
def test_copied_entries_make_the_study_of_the_scenario(run, found, case):
    changes = tomllib.loads(found[case]["toml"])
    study = tomllib.loads(run.study.text)
    study["links"] |= changes.get("links", {})
    study["limits"] |= changes.get("limits", {})
    again = tolstat.run(study, trials=run.trials)
    gap = found[case]["responses"]["gap"]
    lower, upper = again.limits["gap"].permitted
    values = again.column("gap")
    out = float(np.mean((values < lower) | (values > upper)))
    assert gap["share"] == pytest.approx(out, abs=2.1e-4)
    assert gap["mean"] == pytest.approx(values.mean(), abs=2e-4 * gap["sigma"])


def test_quantiles_are_those_of_the_report(run, found):
    quantiles = tolstat.report(run).responses["gap"].quantiles
    expected = [quantiles[share].value for share in (0.00135, 0.5, 0.99865)]
    # deviations are interpolated between normal scores
    sigma = found[0]["responses"]["gap"]["sigma"]
    assert found[0]["quantiles"] == pytest.approx(expected, abs=2e-4 * sigma)


def test_the_address_holds_each_scenario(found):
    assert all(reading["same"] for reading in found)


def test_a_profile_is_the_share_at_each_value(explored, tmp_path):
    halves = [0.03 * MM, 0.06 * MM, 0.12 * MM]
    change = {"entries": {}, "profiles": [["housing", "half", halves]]}
    again = [{"entries": {"housing": {"half": half}}} for half in halves]
    profile, *others = readings(explored, tmp_path, [change, *again])
    shares = [other["responses"]["gap"]["share"] for other in others]
    assert profile["profiles"]["housing half"] == shares


def test_the_script_gets_tables_and_no_distribution(explored):
    data = data_of(explored)
    assert {*data["distributions"]} >= {"normal", "uniform", "triangular"}
    for table in data["distributions"].values():
        assert len(table["deviations"]["base64"]) == 4 * -(-513 * 8 // 3)


def test_the_page_is_one_file(explored, tmp_path):
    page = explored.save(tmp_path / "page.html").read_text("utf-8")
    assert "http:" not in page
    assert "https:" not in page
    assert len(page) < 1e6
