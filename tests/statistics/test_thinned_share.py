"""Shares from thinned trials."""

import numpy as np
import pytest

from tolstat.statistics.deciding.chances import Ranking, chances
from tolstat.statistics.deciding.thinned_share import (
    counted_stages,
    thinned_share,
    trials_settling,
)
from tolstat.statistics.intervals.shares import anytime_valid
from tolstat.statistics.intervals.weights import Thinned
from tolstat.statistics.limits.limit import Limit

PLAIN, PERMITTED = 2048, 0.01


def thinned(number, rng, share=PERMITTED, seen=0.9, chance=0.05, stages=4):
    """Return units of which a part lies where nothing is suspected, thinned."""
    units, columns = [rng.random(PLAIN) < share], [np.ones(PLAIN)]
    drawn, least = [np.full(PLAIN, PLAIN)], [np.ones(PLAIN)]
    for stage in range(1, stages + 1):
        suspected = rng.random(number) < 0.1
        rate = np.where(suspected, share * seen / 0.1, share * (1 - seen) / 0.9)
        chances_of = np.where(suspected, 1.0, chance)
        evaluated = rng.random(number) < chances_of
        units.append((rng.random(number) < rate)[evaluated])
        columns.append(chances_of[evaluated])
        rows = np.count_nonzero(evaluated)
        drawn.append(np.full(rows, PLAIN + stage * number))
        least.append(np.full(rows, chance))
    columns = [np.concatenate(x).astype(float) for x in (columns, drawn, least)]
    return np.concatenate(units), Thinned(*columns)


def test_one_stage_is_that_of_plain_trials():
    units = np.random.default_rng(1).random(PLAIN) < PERMITTED
    ones = np.ones(PLAIN)
    found = thinned_share(units, Thinned(ones, PLAIN * ones, ones))
    expected = anytime_valid(int(units.sum()), PLAIN)
    np.testing.assert_allclose(found[:3], expected[:3], rtol=1e-8)
    others = thinned_share(~units, Thinned(ones, PLAIN * ones, ones))
    np.testing.assert_allclose(others[:3], expected.complement[:3], rtol=1e-12)


def test_the_share_is_expected_whatever_the_chances():
    rng = np.random.default_rng(2)
    shares = []
    for _ in range(100):
        units, how = thinned(4000, rng)
        shares.append(counted_stages(units, how).share)
    error = np.std(shares) / 10
    assert abs(np.mean(shares) - PERMITTED) < 3 * error < 1e-3


@pytest.mark.parametrize("seen", [0.9, 0.1])  # what is suspected, or what is not
def test_the_interval_misses_seldom_at_any_stage(seen):
    """Each end may miss 2.5 %: of 150 runs nine with a chance of 1 %."""
    rng, low, high = np.random.default_rng(3), 0, 0
    for _ in range(150):
        units, how = thinned(4000, rng, seen=seen)
        stages = counted_stages(units, how)
        low += stages.evidence(PERMITTED, 1) > np.log(40)
        high += stages.evidence(PERMITTED, -1) > np.log(40)
    assert low <= 9 and high <= 9


@pytest.mark.parametrize("ratio", [0.5, 2.0])
def test_it_settles_with_fewer_evaluated_trials(ratio):
    units, how = thinned(40_000, np.random.default_rng(4), ratio * PERMITTED)
    share = thinned_share(units, how)
    assert (share.upper < PERMITTED) if ratio < 1 else (share.lower > PERMITTED)
    assert len(units) < how.drawn[-1] / 4
    assert trials_settling(units, how, PERMITTED) < len(units)


def test_evidence_stays_after_a_stage():
    """What is decided stays so: later stages widen no interval."""
    units, how = thinned(4000, np.random.default_rng(5))
    shares = [
        thinned_share(units[:end], how.first(end)) for end in how.ends if end > PLAIN
    ]
    assert all(np.diff([share.lower for share in shares]) >= -1e-9)
    assert all(np.diff([share.upper for share in shares]) <= 1e-9)


def test_a_point_mass_is_ranked():
    """A loss that is zero in most trials: its trials out of limit come first."""
    rng = np.random.default_rng(6)
    x = rng.standard_normal((PLAIN, 6))
    loss = np.maximum(x[:, 0] - x[:, 1] + 0.3 * x[:, 2] ** 2 - 2.5, 0.0)
    assert np.mean(loss == 0) > 0.9
    limit = Limit(-np.inf, 1.5)
    out = loss > 1.5
    ranking = Ranking.fitted(x, loss, limit)
    assert np.mean(ranking.by_other > ranking.by_other[out].min()) < 0.06
    ones = np.ones(PLAIN)
    chosen = chances(ranking, out, Thinned(ones, PLAIN * ones, ones), 0.005)
    assert np.all(np.diff(chosen.chance) >= 0) and chosen.chance[0] < 0.5
    more = ranking.of_more(np.concatenate([x, x[:10]]))
    np.testing.assert_allclose(more.by_other[PLAIN:], ranking.scores(x[:10]))
