"""A run that names the pair behind its machines beyond: screen, JSON, page."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm

import tolstat
from tolstat.answers.pages import report
from tolstat.answers.report.gather import findings_of
from tolstat.answers.report.summary_table import summary_table
from tolstat.answers.report.template_page import make_page, pictures_of
from tolstat.answers.report.verdict_sentences import sentences_of
from tolstat.render.plain import plain
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


def test_the_pair_is_named_with_what_it_explains(run, tmp_path):
    culprits = findings_of(run).responses["gap"].culprits
    (pair,), beyond = culprits.pairs, int(run.beyond("gap").sum())
    apart = "part_1 high with angle low, or the other way round"
    assert pair.words == apart
    assert pair.together.far.value == 1.0 > pair.together.alone
    assert pair.halved == run.evidence.halved["gap"][("part_1", "angle")].beyond
    known = 2 * norm.sf(1.2 * 6 / np.sqrt(2))  # a sixth of a millimetre each
    assert pair.halved.lower <= known <= pair.halved.upper < 0.006
    (said,) = [n for n in summary_table(run).notes if n.startswith("beyond gap")]
    assert (
        f"beyond gap: {apart}: far off (among the farthest 5 % of all machines) in "
        f"100 % of these {beyond}; either alone in" in said
    )
    found = plain(findings_of(run))["responses"]["gap"]["culprits"]["pairs"][0]
    assert found["together"]["members"] == ["part_1", "angle"]
    page = report(run, tmp_path / "page.html").read_text()
    assert f"Together: <strong>{apart}</strong>" in page
    first = re.sub(r"\s+", " ", re.sub("<[^>]*>", "", page.split("</section>")[0]))
    assert f"{apart}: far off (among the farthest 5 % of all machines)" in first
    assert "either alone in" in first
    assert f"of the {beyond} machines beyond gap" in first
    assert "with both tolerances halved" in first and "drive" not in first


def test_alike_parts_are_named_together(run):
    """What explains as much, for all that is known, is not kept back."""
    found = findings_of(run)
    culprits = found.responses["gap"].culprits
    (pair,) = culprits.pairs
    part = Estimate(0.97, 0.90, 0.99)
    first = pair._replace(together=pair.together._replace(far=part))
    as_much = pair._replace(
        words="part_2 high with angle low",
        together=pair.together._replace(far=part._replace(value=0.93, upper=0.975)),
    )
    less = as_much._replace(
        together=pair.together._replace(far=part._replace(value=0.93, upper=0.96))
    )
    both = culprits._replace(pairs=(first, as_much, less))
    assert both.pair == first and both.likewise == (as_much,)
    assert f"{pair.words}, likewise part_2 high" in both.sentence("gap")
    assert culprits.likewise == ()
    # halved are the tolerances of one of them, which is said
    for of, tolerances in (
        (both, "with the tolerances of part_1 and angle halved"),
        (culprits, "with both tolerances halved"),
    ):
        assert tolerances in first_page(run, found, culprits=of)


def test_the_single_one_is_named_where_no_pair_explains_more(run):
    """Screen and first page choose alike."""
    found = findings_of(run)
    culprits = found.responses["gap"].culprits
    (pair,) = culprits.pairs
    as_much = pair.together._replace(single=pair.together.far.value)
    single = culprits._replace(
        pairs=(pair._replace(together=as_much),), driving=("angle",)
    )
    assert single.sentence("gap") == "beyond gap: angle differs by more than chance"
    responses = {"gap": replace(found.responses["gap"], culprits=single)}
    (driver, *_) = sentences_of(replace(found, responses=responses, interest=()))
    assert (driver.name, driver.pair) == ("angle", False)
    assert driver.limits[0][1][-2:] == ["contributors", "angle"]


def test_where_the_gain_of_all_cannot_be_told_that_of_some_is(run):
    """Of a pair that lies in a kind of part; else of its clearest member, told."""
    found = findings_of(run)
    response = found.responses["gap"]
    (pair,), (kind,) = response.culprits.pairs, response.members
    unknown = Estimate(np.nan, reason="3 effective trials are too few")
    of_kind = response.culprits.contributors["angle"]._replace(halved=unknown)
    single = response.culprits._replace(
        pairs=(pair._replace(together=pair.together._replace(single=1.0)),),
        driving=(kind,),
        kinds={kind: of_kind},
    )
    vague = response.culprits._replace(pairs=(pair._replace(halved=unknown),))
    of_one = {name: each for name, each in vague.contributors.items() if each.clear}
    assert set(of_one) == {"part_1", "angle"}
    of_one["part_1"] = of_one["part_1"]._replace(halved=unknown)
    cases = (
        (single, ("part_1", "angle"), ["pairs", 0]),
        (vague._replace(contributors=of_one), ("angle",), ["contributors", "angle"]),
    )
    for culprits, parts, way in cases:
        members = {kind: ("part_1", "part_2", "angle")}
        of = replace(response, culprits=culprits, members=members)
        said = replace(found, responses={**found.responses, "gap": of})
        (driver, *_) = sentences_of(said)
        path = ["responses", "gap", "culprits", *way]
        assert driver.instead == {"gap": (parts, path)}
        page = re.sub("<[^>]*>", "", make_page(run, said, pictures_of(run, said)))
        first = re.sub(r"\s+", " ", page)
        assert f"too few); with that of {' and that of '.join(parts)} halved" in first
    (driver, *_) = sentences_of(found)
    assert driver.instead == {}


def first_page(run, found, **changes):
    """What the first page says where findings of the gap are others."""
    of = replace(found.responses["gap"], **changes)
    said = replace(found, responses={**found.responses, "gap": of})
    page = make_page(run, said, pictures_of(run, said)).split("</section>")[0]
    return re.sub(r"\s+", " ", re.sub("<[^>]*>", "", page))


@pytest.mark.parametrize(
    ("lower", "upper", "told"),
    [(900e-6, 950e-6, True), (900e-6, 1e-3, False), (0.0, 1.5e-3, False),
     (1e-3, 21e-3, False), (21e-3, 30e-3, True)],
)  # fmt: skip
def test_a_gain_is_claimed_only_where_the_intervals_lie_apart(run, lower, upper, told):
    found = findings_of(run)
    response = found.responses["gap"]
    now = Estimate(10e-3, 1e-3, 20e-3)
    yields = response.limited.yields._replace(beyond=now)
    (pair,) = response.culprits.pairs
    then = Estimate(lower, lower, upper)
    first = first_page(
        run, found,
        limited=response.limited._replace(yields=yields),
        culprits=response.culprits._replace(pairs=(pair._replace(halved=then),)),
    )  # fmt: skip
    assert first.count("of a million are beyond gap, ") == 1
    assert ("of a million are beyond gap, not 10000." in first) == told
    vague = "gap, now 10000 (1000 .. 20000): these intervals do not tell them apart."
    assert (vague in first) != told


def with_gains(response, single, parts=(2e-3, 3e-3), both=1e-3, far=9e-3):
    """Culprits of whom halving leaves shares beyond: of the pair 2000, 3000, 1000."""
    found = response.culprits
    (pair,), (kind,) = found.pairs, response.members

    def left(each, share):
        return each._replace(halved=Estimate(share, share / 2, 2 * share))

    every = {name: left(each, far) for name, each in found.contributors.items()}
    for name, share in zip(pair.together.members, parts, strict=True):
        every[name] = left(every[name], share)
    kinds = {kind: left(found.kinds[kind], far)}
    for name, share in single.items():
        of = kinds if name == kind else every
        of[name] = left(of[name], share)
    return found._replace(contributors=every, kinds=kinds, pairs=(left(pair, both),))


def test_a_single_tolerance_that_gains_more_is_not_hidden_by_the_pair(run):
    found = findings_of(run)
    response = found.responses["gap"]
    (kind,) = response.members
    (pair,) = response.culprits.pairs
    (other,) = set(response.members[kind]) - set(pair.together.members)
    yields = response.limited.yields._replace(beyond=Estimate(0.02, 0.01, 0.03))
    limited = response.limited._replace(yields=yields)

    def said(**gains):
        return first_page(
            run, found, limited=limited, culprits=with_gains(response, **gains)
        )

    clause = "; of single tolerances that of "
    end = "gains most in these trials: with it halved "
    first = said(single={other: 1.5e-3})
    assert f"{clause}{other} {end}1500 (800 .. 3000) of a million are beyond" in first
    first = said(single={kind: 0.6e-3})
    assert f"{clause}{kind} (2 parts) {end}600 (300 .. 1200) of a million" in first
    silent = (
        {"single": {}},  # others gain less than either of the pair
        {"single": {other: 2.5e-3}},
        {"single": {kind: 1.5e-3}},  # several parts gain less than both
        {"single": {other: 6e-3}, "parts": (7e-3, 8e-3)},  # not told from now
        {"single": {other: 1e-3}, "parts": (2e-3, np.nan)},  # that of one is not known
        {"single": {other: np.nan}},
    )
    for gains in silent:
        assert clause not in said(**gains), gains
    few = response.limited.yields._replace(beyond=Estimate(1e-4, 5e-5, 2e-4))
    limited = limited._replace(yields=few)
    assert clause not in said(single={other: 1.5e-3})  # nothing gains
