"""What-if of cheap models: scenarios are evaluated, several of them side by side."""

from __future__ import annotations

import json

import numpy as np
import pytest
from click.testing import CliRunner
from scipy.stats import norm

import tolstat
from tests.answers.page_checks import blocks_of
from tests.conftest import Toy
from tolstat.answers.what_if.what_if_answer import Method
from tolstat.cli.main import main
from tolstat.cli.what_if import scenarios_in
from tolstat.document.blocks import Gallery
from tolstat.errors import QuestionError, StudyError
from tolstat.study.editor import StudyChange

STUDY = {
    "model": "dimension_chain",
    "trials": 4000,
    "seed": 3,
    "sampling": "random",
    "settings": {"gap": "bore - sleeve - ring"},
    "links": {
        "bore": "50.2 +-0.06 mm",
        "sleeve": "40 h9 mm",
        "ring": {"nominal": "10 mm", "tolerance": "+-0.02 mm",
                 "distribution": "uniform"},
    },
    "limits": {"gap": "0.15..0.3 mm"},
}  # fmt: skip
GRADES = {"h8": 39e-6, "h9": 62e-6, "h11": 160e-6}


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    path = tmp_path_factory.mktemp("chain") / "chain.h5"
    return tolstat.run(STUDY, output=path)


def share_out(grade, shift=0.0):
    """The fraction out of limit of the chain, by quadrature over the ring."""
    zone = GRADES[grade]
    mean, sigma = 0.2e-3 + zone / 2 - shift, np.hypot(20e-6, zone / 6)
    ring = np.linspace(-20e-6, 20e-6, 20_001)
    out = norm.cdf((0.15e-3 - mean + ring) / sigma) + norm.sf(
        (0.3e-3 - mean + ring) / sigma
    )
    return np.trapezoid(out, ring) / 40e-6


@pytest.mark.parametrize(("grade", "shift"), [("h8", 0), ("h11", 0), ("h9", 0.05e-3)])
def test_a_scenario_that_stored_trials_do_not_cover_is_evaluated(run, grade, shift):
    change = {"tolerance": grade} if not shift else {"shift": "+=0.05 mm"}
    found = tolstat.what_if(run, {"sleeve": change})
    assert found.method is Method.EVALUATED and found.trials == 4000
    gap = found.responses["gap"]
    share, truth = (
        gap.scenario.limited.yields.fraction_out_of_limit,
        share_out(grade, shift),
    )
    assert share.lower <= truth <= share.upper
    less = gap.difference.limit.fraction_out_of_limit_difference
    assert less.lower <= truth - share_out("h9") <= less.upper
    # the same trials: the interval is narrower than that of two runs
    before = gap.baseline.limited.yields.fraction_out_of_limit
    assert less.upper - less.lower < (share.upper - share.lower) + (
        before.upper - before.lower
    )
    moved = gap.scenario.mean.value - gap.baseline.mean.value
    assert gap.difference.mean.value == pytest.approx(moved, rel=1e-9)


def test_the_same_scenario_in_a_run_of_its_own_has_the_same_numbers(run):
    found = tolstat.what_if(run, {"sleeve": "h11"})
    fresh = tolstat.run({**STUDY, "links": {**STUDY["links"], "sleeve": "40 h11 mm"}})
    own = tolstat.summary(fresh).responses["gap"]
    assert found.responses["gap"].scenario.quantiles == own.quantiles
    assert found.all_limits.scenario == tolstat.summary(fresh).all_limits


def test_a_size_is_a_scenario(run):
    found = tolstat.what_if(run, {"sleeve": {"nominal": "40.05 mm"}})
    gap = found.responses["gap"]
    assert gap.difference.mean.value == pytest.approx(-0.05e-3)
    assert "40.05 mm" in found.words


def test_a_shift_alone_keeps_all_else_and_adds_up(run):
    for name, text in (("sleeve", "+=0.02 mm"), ("ring", "0.02 mm")):
        found = tolstat.what_if(run, {name: {"shift": text}})
        gap = found.responses["gap"]
        assert gap.difference.mean.value == pytest.approx(-0.02e-3)
        assert gap.scenario.sigma.value == pytest.approx(gap.baseline.sigma.value)
    twice = tolstat.fresh_study(run, {"ring": {"shift": "-=0.01 mm"}})
    assert 'nominal_shift = "-0.01 mm"' in twice
    assert "sigma" not in twice and 'distribution = "uniform"' in twice


def test_limits_alone_are_a_scenario(run):
    found = tolstat.what_if(run, {}, limits={"gap": ">= 0.18 mm"})
    gap = found.responses["gap"]
    assert found.method is Method.STORED
    assert gap.baseline.limited.limit.words == "0.15..0.3 mm"
    out = np.mean(run.column("gap") < 0.18e-3)
    assert gap.scenario.limited.yields.fraction_out_of_limit.value == out
    with pytest.raises(StudyError, match="no entry"):
        tolstat.what_if(run, {})


@pytest.mark.parametrize(
    "wrong", [[], (), "sleeve", None, 3, StudyChange({"sleeve": "h8"}), ["sleeve"]]
)
def test_what_is_no_scenario_is_refused(run, wrong):
    with pytest.raises(StudyError, match=r"a mapping .* change\.deviations"):
        tolstat.what_if(run, wrong)


def test_trials_of_another_source_are_not_compared(toy, toy_study):
    """The scenario would be of another design: worse ones were met."""

    class Thicker(Toy):
        def evaluate(self, deviations, settings):
            return super().evaluate(deviations + 0.2e-3, settings)

    stored = tolstat.run(toy_study, model=toy)
    change = {"part": "+-0.1 mm"}
    assert tolstat.what_if(stored, change, model=toy).method is Method.EVALUATED
    with pytest.raises(QuestionError, match=r"another source .* of two models"):
        tolstat.what_if(stored, change, model=Thicker())


def test_several_scenarios_stand_side_by_side(run):
    scenarios = [{"sleeve": "h8"}, {"sleeve": "h11"}, {"ring": {"shift": "+=0.02 mm"}}]
    found = tolstat.what_if(run, scenarios)
    one = tolstat.what_if(run, scenarios[1])
    assert found.scenarios[1].responses == one.responses
    table = found.frame()
    assert len(table) == 3 and table["scenario"].nunique() == 3
    (gallery,) = (x for x in blocks_of(found.document()) if isinstance(x, Gallery))
    figure, *pairs = gallery.figures
    assert len(pairs) == 3  # trials of each over those of the baseline
    names = [layer.name for layer in figure.picture.panels[0].layers[:4]]
    assert names == ["baseline", *(x.words for x in found.scenarios)]
    page = found.html()
    assert "<svg" in page and "<img" not in page


def test_latin_trials_are_evaluated_too(tmp_path):
    run = tolstat.run({**STUDY, "sampling": "latin"}, output=tmp_path / "latin.h5")
    found = tolstat.what_if(run, {"sleeve": "h8"})
    assert found.responses["gap"].difference.mean.sure
    with pytest.raises(QuestionError, match="random"):
        tolstat.what_if(run, {"sleeve": "h8"}, evaluate=False)


def test_words_of_the_command_line_are_scenarios():
    h8, h11, moved = {"s": "h8"}, {"s": "h11"}, {"b": {"shift": "+=0.02 mm"}}
    assert scenarios_in(["s=h8", "s=h11", "b+=0.02 mm"]) == [h8, h11, moved]
    assert scenarios_in(["s=h8", "b+=0.02 mm"]) == [{**h8, **moved}]
    both = scenarios_in(["s=h8", "b+=0.02 mm", "or", "s=h11"])
    assert both == [{**h8, **moved}, h11]
    assert scenarios_in(["b-=1 um"]) == [{"b": {"shift": "-=1 um"}}]
    assert scenarios_in([]) == [{}]


def test_the_command_line_compares_scenarios(run, tmp_path):
    def ask(*words):
        return CliRunner().invoke(main, ["what-if", str(run.path), *words])

    shown = ask("sleeve=h8", "sleeve=h11", "ring+=0.02 mm")
    assert shown.exit_code == 0
    assert "less the baseline, ppm" in shown.output
    found = json.loads(ask("sleeve=h8", "sleeve=h11", "--json").output)
    assert [x["method"] for x in found["scenarios"]] == ["evaluated"] * 2
    lines = ask("sleeve=h8", "sleeve=h11", "--csv").output.splitlines()
    assert len(lines) == 3
    limit = ask("--limit", "gap >= 0.18 mm")
    assert limit.exit_code == 0 and "0.15..0.3 mm -> >= 0.18 mm" in limit.output
    refused = ask("sleeve=h8", "sleeve=h9", "--write", str(tmp_path / "a.toml"))
    assert refused.exit_code == 2 and "one scenario" in refused.output
    weighted = ask("sleeve=h11", "--reweight")
    assert weighted.exit_code == 2 and "--write" in weighted.output
