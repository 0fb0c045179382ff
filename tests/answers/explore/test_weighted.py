"""The page of a model that is not evaluated: stored trials weighted, as by what-if."""

import shlex
import shutil
import tomllib

import pytest
from click.testing import CliRunner

import tolstat
from tests.answers.explore.node import data_of, readings, rows_of
from tests.conftest import ROOT
from tolstat.cli.main import main
from tolstat.errors import QuestionError

MM = 1e-3
SCENARIOS = [
    ({"rod": {"half": 0.15 * MM}}, {"rod": "+-0.15 mm"}, None),
    (
        {"rod": {"half": 0.17 * MM}, "crank": {"shift": 0.02 * MM}},
        {"rod": "+-0.17 mm", "crank": {"shift": "+=0.02 mm"}},
        {"slide": "168.2..169 mm"},
    ),
    (
        {"crank": {"kind": "screened"}},
        {
            "crank": {
                "tolerance": "+-0.1 mm",
                "distribution": "truncated_normal",
                "outside": "screened",
            }
        },
        None,
    ),
]
LIMITS = {"slide": {"lower": 168.2 * MM, "upper": 169 * MM}}


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A vector loop: its unknowns are solved for, so its trials are weighted."""
    folder = tmp_path_factory.mktemp("weighted")
    study = shutil.copy(ROOT / "runs" / "slider-crank.toml", folder)
    return tolstat.run(study, trials=6000)


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


def test_it_is_weighted(explored):
    data = data_of(explored)
    assert not data["evaluated"]
    assert "formula" not in data["responses"][0]


@pytest.mark.parametrize("case", range(len(SCENARIOS)))
def test_numbers_are_those_of_what_if(run, found, case):
    _, deviations, limits = SCENARIOS[case]
    answer = tolstat.what_if(run, deviations, limits=limits, evaluate=False)
    assert found[case]["covered"]
    assert found[case]["effective"] == pytest.approx(
        answer.effective_sample_size, rel=0.05
    )
    for name, response in answer.responses.items():
        summary, reading = response.scenario, found[case]["responses"][name]
        share, lower, upper, _ = summary.limited.yields.fraction_out_of_limit
        assert reading["share"] == pytest.approx(share, rel=2e-3, abs=1e-7)
        assert reading["range"][0] == pytest.approx(lower, rel=0.02, abs=1e-6)
        # the cap of the weights is of other new units than there
        assert reading["range"][1] == pytest.approx(upper, rel=0.2)
        assert reading["mean"] == pytest.approx(
            summary.mean.value, abs=2e-3 * reading["sigma"]
        )


@pytest.mark.parametrize("case", range(len(SCENARIOS)))
def test_copied_commands_agree(run, found, case, tmp_path):
    table = tmp_path / "answer.csv"
    command = [*shlex.split(found[case]["command"])[1:], "-o", str(table)]
    done = CliRunner().invoke(main, command)
    assert done.exit_code == 0, done.output
    for row in rows_of(table):
        reading = found[case]["responses"][row["response"]]
        assert float(row["fraction out of limit [ppm]"]) == pytest.approx(
            1e6 * reading["share"], rel=5e-3, abs=0.1
        )


def test_what_trials_do_not_cover_is_said_with_the_command(run, explored, tmp_path):
    change = {"entries": {"rod": {"half": 0.4 * MM}}}
    (reading,) = readings(explored, tmp_path, [change])
    assert not reading["covered"]
    assert reading["reasons"][0].startswith("rod: ")
    first, second = map(shlex.split, reading["command"].splitlines())
    assert first[:4] == ["tolstat", "what-if", str(run.path), "rod=+-0.4 mm"]
    assert first[4:] == ["--write", second[2]]
    assert second[:2] == ["tolstat", "run"]
    assert CliRunner().invoke(main, first[1:]).exit_code == 0
    study = tolstat.run(second[2], trials=10).study
    assert study.table["links"]["rod"]["tolerance"] == "+-0.4 mm"


def test_a_profile_is_the_share_at_each_value(explored, tmp_path):
    halves = [0.15 * MM, 0.2 * MM, 0.4 * MM]
    start = {"crank": {"shift": 0.02 * MM}}
    change = {"entries": start, "profiles": [["rod", "half", halves]]}
    again = [{"entries": {**start, "rod": {"half": half}}} for half in halves]
    profile, *others = readings(explored, tmp_path, [change, *again])
    name = data_of(explored)["responses"][0]["name"]
    shares = [other["responses"][name]["share"] for other in others[:2]]
    assert profile["profiles"]["rod half"][:2] == pytest.approx(shares, rel=1e-9)
    assert profile["profiles"]["rod half"][2] is None  # not covered


@pytest.fixture(scope="module")
def batch():
    """Parts of one batch in part, and a correlation."""
    return tolstat.run(
        {
            "model": "dimension_chain", "trials": 6000, "seed": 3,
            "links": {
                "a": "10 +-0.2 mm", "b_1": "20 mm", "b_2": "30 mm",
                "phi": "60 +-0.5 deg",
            },
            "loops": {"main": "a @ phi + b_1 @ theta - slide @ 0 deg"},
            "gaps": {"play": "slide + b_2"},
            "deviations": {"b": {"tolerance": "+-0.3 mm", "common": 0.6}},
            "correlation": {"a": {"phi": 0.5}},
            "limits": {"play": "52.8..53.7 mm"},
        }
    )  # fmt: skip


def test_batches_and_correlations_are_weighted_together(batch, tmp_path):
    explored = tolstat.explore(batch)
    changes = [{"entries": {"b": {"half": 0.25 * MM}}},
               {"entries": {"a": {"half": 0.17 * MM}}}]  # fmt: skip
    texts = [{"b": "+-0.25 mm"}, {"a": "+-0.17 mm"}]
    for reading, text in zip(readings(explored, tmp_path, changes), texts, strict=True):
        answer = tolstat.what_if(batch, text, evaluate=False)
        summary = answer.responses["play"].scenario
        share = summary.limited.yields.fraction_out_of_limit.value
        assert 0 < share < 0.2
        assert reading["responses"]["play"]["share"] == pytest.approx(share, rel=2e-3)
        assert reading["covered"]
        assert reading["effective"] == pytest.approx(
            answer.effective_sample_size, rel=0.1
        )


def test_trials_that_depend_on_each_other_are_refused():
    study = tomllib.loads((ROOT / "runs" / "slider-crank.toml").read_text())
    run = tolstat.run({**study, "sampling": "latin", "trials": 160})
    with pytest.raises(QuestionError, match="depend on each other"):
        tolstat.explore(run)
