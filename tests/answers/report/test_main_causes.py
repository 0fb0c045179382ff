"""A run that names the pair behind its out-of-limit trials: screen, JSON, page."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm

import tolstat
from tests.answers.browser import Page
from tests.answers.page_checks import words_in
from tolstat.answers.report.first_page import first_page, limits_table
from tolstat.answers.report.gather import report_of
from tolstat.document.blocks import Section, Table
from tolstat.render.screen import as_text, show
from tolstat.statistics.estimate import Estimate

DEGREE = np.pi / 180
STUDY = {
    "model": "toy", "trials": 3000, "seed": 3,
    "deviations": {"part": "+-1 mm", "angle": "+-1 deg"},
    "limits": {"gap": "-1.2..1.2 mm"},
}  # fmt: skip


@pytest.fixture
def run(toy, tmp_path):
    class Apart(type(toy)):
        """What matters is a part and an angle, which are of no kind."""

        def evaluate(self, deviations, settings):
            gap = deviations[:, 0] - deviations[:, 2] * 1e-3 / DEGREE
            return (
                super()
                .evaluate(deviations, settings)
                ._replace(responses=np.stack([gap, gap], axis=1), status=None)
            )

    return tolstat.run(STUDY, model=Apart(), output=tmp_path / "apart.h5")


def with_causes(found, causes, **limited):
    """The report with other causes of the gap, or other numbers of its limit."""
    gap = found.responses["gap"]
    gap = replace(gap, causes=causes, limited=gap.limited._replace(**limited))
    return replace(found, responses={**found.responses, "gap": gap})


def row_of(found):
    """Main cause, what it explains, and what would help, as the page has them."""
    table = limits_table(found)
    heads = [each.head for each in table.columns]
    row = dict(zip(heads, table.rows[0], strict=True))
    return row["main cause"], row["what would help"]


def steps_of(found):
    """What the first page says to do next."""
    for block in first_page(found):
        if isinstance(block, Section) and block.title == "What to do next":
            return [as_text(item) for item in block.blocks[0].items]
    return []


def test_the_pair_is_named_with_its_explained_share(run, capsys):
    found = report_of(run)
    causes = found.responses["gap"].causes
    (pair,), out = causes.pairs, int(run.beyond("gap").sum())
    apart = "part_1 and angle differ: one high, one low"
    assert pair.words == apart
    assert pair.together.far.value == 1.0 > pair.together.alone
    assert pair.halved == run.diagnostics.halved["gap"][("part_1", "angle")].beyond
    known = 2 * norm.sf(1.2 * 6 / np.sqrt(2))  # a sixth of a millimetre each
    assert pair.halved.lower <= known <= pair.halved.upper < 0.006
    cause, effect = row_of(found)
    assert as_text(cause.main) == apart
    explained = f"{out} of {out} out-of-limit trials in its outer 5 %"
    assert as_text(cause.below) == explained
    assert as_text(effect.main) == "halve part_1 and angle"  # 0.5 mm, 0.5 deg
    assert effect.below[0].value == pair.halved
    said = json.loads(found.json())["responses"]["gap"]["causes"]["pairs"][0]
    assert said["together"]["members"] == ["part_1", "angle"]
    text = " ".join(Page(found.html()).text.split())
    assert f"{explained}; either of them alone in" in text and apart in text
    document = tolstat.summary(run).document()
    assert apart in words_in(*document.blocks)
    show(document)
    shown = capsys.readouterr().out  # in lines of its column
    assert "part_1 and angle" in shown and set(apart.split()) <= set(shown.split())


def test_equivalent_parts_are_named_together(run):
    """What explains as much, as far as the trials tell, is not kept back."""
    found = report_of(run)
    causes = found.responses["gap"].causes
    (pair,) = causes.pairs
    part = Estimate(0.97, 0.90, 0.99)
    first = pair._replace(together=pair.together._replace(far=part))
    as_much = pair._replace(
        words="part_2 high with angle low",
        together=pair.together._replace(far=part._replace(value=0.93, upper=0.975)),
    )
    less = as_much._replace(
        together=pair.together._replace(far=part._replace(value=0.93, upper=0.96))
    )
    both = causes._replace(pairs=(first, as_much, less))
    assert both.pair == first and both.equivalent_pairs == (as_much,)
    assert causes.equivalent_pairs == ()
    words = as_text(row_of(with_causes(found, both))[0].main)
    assert words == f"{pair.words}; or equally {as_much.words}"


def test_a_single_cause_is_named_if_no_pair_explains_more(run):
    found = report_of(run)
    causes = found.responses["gap"].causes
    (pair,) = causes.pairs
    as_much = pair.together._replace(single=pair.together.far.value)
    single = causes._replace(
        pairs=(pair._replace(together=as_much),), leading=("angle",)
    )
    assert single.pair is None and single.main == causes.contributors["angle"]
    cause, effect = row_of(with_causes(found, single))
    assert as_text(cause.main) == "angle"
    assert as_text(cause.below).startswith("significant at ")
    assert as_text(effect.main) == "angle to +-0.5 deg"
    assert effect.below[0].value == causes.contributors["angle"].halved


@pytest.mark.parametrize(
    ("lower", "upper", "told"),
    [(900e-6, 950e-6, True), (900e-6, 1e-3, False), (0.0, 1.5e-3, False),
     (1e-3, 21e-3, False), (21e-3, 30e-3, True)],
)  # fmt: skip
def test_a_gain_is_claimed_only_for_separate_intervals(run, lower, upper, told):
    found = report_of(run)
    gap = found.responses["gap"]
    yields = gap.limited.yields._replace(
        fraction_out_of_limit=Estimate(10e-3, 1e-3, 20e-3)
    )
    (pair,) = gap.causes.pairs
    then = Estimate(lower, lower, upper)
    causes = gap.causes._replace(pairs=(pair._replace(halved=then),))
    changed = with_causes(found, causes, yields=yields)
    _, effect = row_of(changed)
    assert as_text(effect.below).endswith("no significant change") != told
    halve = [each for each in steps_of(changed) if each.startswith("Halve")]
    assert bool(halve) == (told and upper < 1e-3)
    if halve:
        assert "part_1 and angle: gap falls from 10000 ppm" in halve[0]
        study = run.path.with_name("apart-halved.toml")
        typed = f"'part_1=+-0.5 mm' 'angle=+-0.5 deg' --write {study}"
        assert f"tolstat what-if {run.path} {typed}" in halve[0]


def test_an_effect_that_is_not_estimable_has_a_reason(run):
    found = report_of(run)
    causes = found.responses["gap"].causes
    (pair,) = causes.pairs
    unknown = Estimate(np.nan, reason="3 effective trials are too few")
    vague = causes._replace(pairs=(pair._replace(halved=unknown),))
    changed = with_causes(found, vague)
    _, effect = row_of(changed)
    assert as_text(effect.main) == "halve part_1 and angle"
    assert as_text(effect.below) == f"effect not estimable: {unknown.reason}"
    assert not any(each.startswith("Halve") for each in steps_of(changed))
    step = steps_of(changed)[0]  # a fresh run tells what these trials do not
    test = "Test half the tolerances of part_1 and angle: the effect on gap is not"
    assert step.startswith(f"{test} estimable. Check it with a fresh run: tolstat ")
    none = causes._replace(pairs=(vague.pairs[0]._replace(effective_sample_size=0),))
    assert steps_of(with_causes(found, none))[0] == step
    table = next(b for b in first_page(changed) if isinstance(b, Table))
    assert table.title == "Limits"
