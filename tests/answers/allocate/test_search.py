"""The search: choices that are tried, proved and scaled; active limits."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ndtr, ndtri
from scipy.stats import binom

from tests.answers.allocate.linear_stack import (
    LIMIT,
    SLOPES,
    Idle,
    closed_form,
    listed,
    reciprocal,
    searching,
)
from tolstat.answers.allocate.reweighted_pool import Pool
from tolstat.answers.allocate.search import _aimed
from tolstat.statistics.intervals.shares import anytime_valid


def test_the_pool_has_the_trials_of_the_run():
    """They are drawn again; a run that grew is drawn as long as it is."""
    search = searching(reciprocal(), trials=500)
    near = search.runs.as_written(tuple(np.log(0.9 * closed_form()[1])))
    proof = search.stretched([near], search.proved(), 16_000)
    assert proof.scheme.trials > 2000
    pool = search.pool
    gap = np.transpose([*pool._deviations.values()]) @ SLOPES
    assert np.array_equal(np.abs(gap) > LIMIT, pool._out[0])


def test_the_loosest_tolerance_can_be_written():
    given = reciprocal()
    for line in given["deviations"].values():
        line["cost"]["loosest"] = "+-0.41239 mm"
    search = searching(given, Idle())
    assert search.loosest == pytest.approx([math.log(0.412e-3)] * 3)
    tight = search.tightest
    for end in (search.loosest[2], search.priced[2].ends[1]):
        assert search.at_loosest(2, end)
    assert not search.at_loosest(2, tight[2])
    assert search.active_limits(search.loosest) == ()


def test_choices_are_tightened_until_a_run_proves_them(monkeypatch):
    """Weights that promise a seventh less than is so: only fresh runs tell."""

    def promised(pool, choice, miss=0.0, **exact):
        sigma = np.linalg.norm(SLOPES * np.exp(choice) / 3)
        return np.full(2, 0.86 * 2 * float(ndtr(-LIMIT / sigma)))

    monkeypatch.setattr(Pool, "upper_ends", promised)
    search = searching(reciprocal(), trials=40_000)
    proof = search.proved()
    assert proof is not None
    tried = [each.scheme.cost for each in search.failed]
    # each for a twentieth less out of limit than the one before
    cost, _ = closed_form()
    expected = [
        cost * ndtri(0.01 * 0.95**i / 0.86) / ndtri(0.01) for i in range(len(tried) + 1)
    ]
    assert [*tried, proof.scheme.cost] == pytest.approx(expected, rel=1e-2)
    assert 3 <= len(tried) < 6 and cost < proof.scheme.cost < 1.03 * cost


def test_a_failed_choice_of_a_list_is_not_tried_again(monkeypatch):
    """A step tighter is none where the next one offered is far off."""
    given = listed()
    del given["deviations"]["link_2"], given["deviations"]["link_3"]
    share = 0.02 / 0.85  # of the middle one: promised is less than permitted
    end = -float(ndtri(share / 2)) * 0.1e-3 / 3
    given["limits"]["gap"]["limit"] = f"{-1e3 * end}..{1e3 * end} mm"
    halves = (0.2e-3, 0.1e-3, 0.05e-3)

    def promised(pool, choice, miss=0.0, **exact):
        return np.full(2, 0.8 * 2 * float(ndtr(-end / (halves[int(choice[0])] / 3))))

    monkeypatch.setattr(Pool, "upper_ends", promised)
    search = searching(given, trials=20_000)
    proof = search.proved()
    assert proof is not None and proof.choice == (2.0,)
    assert len(search.runs.lengths) == 2 and len(search.failed) == 1


def test_a_limit_is_active_with_a_tolerance_near_its_loosest():
    given = reciprocal()
    own = given["deviations"]["link_1"]["cost"]
    own["loosest"] = "+-0.0503 mm"
    search = searching(given, trials=20_000)
    # all others tightest, but that the limit holds with no more than this one has
    choice = [math.log(0.05e-3), *search.tightest[1:]]
    excess = search.above(search.permitted)

    def last(x):
        return float(excess((choice[0], x, choice[2]))[0])

    choice[1] = brentq(last, *search.priced[1].ends) - 1e-3
    assert search.active_limits(tuple(choice)) == ("gap",)
    only = tuple([choice[0], *(each.ends[1] for each in search.priced[1:])])
    assert excess(only)[0] > 0
    at = tuple(each.ends[1] for each in search.priced)
    assert search.active_limits(at) == ()  # nothing can be looser


def test_a_longer_run_is_used_if_it_proves_a_cheaper_choice():
    search, (cost, _) = searching(reciprocal()), closed_form()
    short = search.proved()
    long = search.stretched([short.choice], short, 80_000)
    assert 1.035 * cost < short.scheme.cost and long.scheme.cost < 1.03 * cost
    assert 10_000 < long.scheme.trials <= 80_000 and long.met
    # the same proportions, but for three digits
    ratios = np.exp(np.subtract(long.choice, short.choice))
    assert np.allclose(ratios, ratios[0], rtol=0.02)
    made = search.runs.lengths
    assert search.stretched([long.choice], long, 80_000) is long
    assert search.runs.lengths == made


@pytest.mark.parametrize(("trials", "permitted"), [(10_000, 0.02), (160_000, 0.01)])
def test_the_target_leaves_a_margin_of_one_standard_error(trials, permitted):
    share = _aimed(trials, permitted)
    counts = np.arange(int(permitted * trials))
    shown = [anytime_valid(n, trials).upper <= permitted for n in counts.tolist()]
    assert 0.80 < binom.cdf(counts[shown].max(), trials, share) < 0.88
