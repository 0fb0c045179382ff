"""Differences of two designs against closed forms, enumeration, jackknife by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats

from tolstat.statistics.estimate import Estimate
from tolstat.statistics.intervals.quantiles import quantiles
from tolstat.statistics.limits.difference import (
    LEAST_OF_MOMENTS,
    MOST_CORRELATED,
    correlation_of_quantiles,
    correlation_of_shares,
    difference,
    difference_of_ppk,
    exchange,
)
from tolstat.statistics.limits.limit import Limit


def machines(both, worse, better, neither):
    """Return who is within in either design."""
    counts = (both, worse, better, neither)
    return np.repeat([1, 1, 0, 0], counts) > 0, np.repeat([1, 0, 1, 0], counts) > 0


def test_units_that_change_sides_have_exact_intervals():
    found = exchange(*machines(970, 9, 3, 18))
    assert (found.worse, found.better) == (9, 3)
    share, lean = (
        stats.binomtest(k, n).proportion_ci(0.975, "exact")
        for k, n in ((12, 1000), (9, 12))
    )
    lower = share.high * (2 * lean.low - 1)  # leans to the better there
    assert lean.low < 0.5
    assert found.out_of_limit[:3] == pytest.approx(
        (0.006, lower, share.high * (2 * lean.high - 1)), rel=1e-9
    )
    nobody = exchange(*machines(1000, 0, 0, 0)).out_of_limit
    assert nobody[:3] == pytest.approx(
        (0, -(1 - 0.0125 ** (1 / 1000)), 1 - 0.0125 ** (1 / 1000)), rel=1e-9
    )


@pytest.mark.parametrize("shares", [(0.1, 0.1), (0.3, 0.02), (0.5, 0.4), (0.05, 0.0)])
def test_every_outcome_together_covers_the_difference_of_yields(shares):
    n, (worse, better) = 15, shares
    missed = 0.0
    for w in range(n + 1):
        for b in range(n + 1 - w):
            p = stats.multinomial.pmf([w, b, n - w - b], n, [*shares, 1 - sum(shares)])
            ends = exchange(*machines(n - w - b, w, b, 0)).out_of_limit
            missed += p * (not ends.lower <= worse - better <= ends.upper)
    assert missed < 0.05


def test_a_difference_combines_both_intervals_by_squares():
    # Newcombe 1998, table II (a): 56 of 70 less 48 of 80 by Wilson scores
    a, b = Estimate(48 / 80, 0.4905, 0.7003), Estimate(56 / 70, 0.6918, 0.8770)
    assert difference(a, b)[:3] == pytest.approx((0.2, 0.0524, 0.3339), abs=2e-4)
    apart = difference(a, b, 0.5)
    assert apart.lower == pytest.approx(
        0.2 - math.sqrt(0.1082**2 + 0.1003**2 - 0.1082 * 0.1003), abs=1e-9
    )
    never, some = Estimate(math.inf, 0.9, math.inf), Estimate(0.8, 0.7, 1.0)
    assert difference(some, never)[:3] == (math.inf, pytest.approx(-0.1), math.inf)
    assert difference(never, some)[:2] == (-math.inf, -math.inf)
    assert difference(never, never).reason == "none out of limit in either"
    open_above = Estimate(1.2, 1.0, math.inf)
    either = difference(open_above, open_above)  # no end is known: not "at least -inf"
    assert either.value == 0 and not either.sure and "infinite" in either.reason
    assert not difference(open_above, never).sure
    for correlation in (0.0, 0.5):
        found = difference(open_above, some, correlation)
        assert found.lower == -math.inf and found.value < found.upper < math.inf
        assert difference(some, open_above, correlation).upper == math.inf
    unsure = difference(some, Estimate(0.9, reason="needs 59"))
    assert unsure.value == pytest.approx(0.1) and unsure.reason == "needs 59"


def test_the_correlation_of_errors_is_at_most_0_9():
    rng = np.random.default_rng(1)
    first = rng.random(500) < 0.2
    second = np.where(rng.random(500) < 0.3, rng.random(500) < 0.2, first)
    more = np.append(first, [True, False]), np.append(second, [False, True])
    assert correlation_of_shares(first, second) == pytest.approx(
        np.corrcoef(*more)[0, 1]
    )
    assert correlation_of_shares(first, first) == MOST_CORRELATED
    many, of_many = (np.repeat(units, 600) for units in (first, second))
    assert 0 < correlation_of_shares(many, of_many) < MOST_CORRELATED  # no overflow
    assert abs(correlation_of_shares(first, np.ones(500, bool))) < 0.1


def test_a_quantile_at_a_point_mass_has_no_correlation():
    z = np.random.default_rng(4).normal(size=300)
    jam = np.maximum(np.abs(z) - 1.9, 0.0)
    found = [quantiles(y, [0.95])[0.95] for y in (jam, z, 0.9 * z)]
    assert found[0].lower == 0.0 < found[0].upper
    assert correlation_of_quantiles(jam, z, (found[0], found[1])) == 0.0
    assert correlation_of_quantiles(z, 0.9 * z, (found[1], found[2])) > 0.8


def test_ppk_by_moments_leaves_out_a_twentieth_at_a_time():
    rng = np.random.default_rng(2)
    z, limits = rng.normal(size=1210), (Limit(-4, 4), Limit(-4, 5))
    first, second = z + 0.2, 0.8 * z + 0.1 * rng.normal(size=1210)

    def more(keep):
        ends = ((first[keep], limits[0].permitted), (second[keep], limits[1].permitted))
        each = [
            min(high - y.mean(), y.mean() - low) / 3 / np.std(y, ddof=1)
            for y, (low, high) in ends
        ]
        return each[1] - each[0]

    number = np.arange(1210)
    left = np.array([more(number % 20 != i) for i in range(20)])
    half = 1.1 * stats.t.ppf(0.975, 19) * np.sqrt(19 * left.var())
    found = difference_of_ppk(first, second, limits)
    value = more(number >= 0)
    assert found[:3] == pytest.approx((value, value - half, value + half), rel=1e-9)


def test_ppk_by_moments_without_a_difference_has_a_reason():
    z, limits = np.random.default_rng(3).normal(size=4000), (Limit(-4, 4),) * 2
    few = difference_of_ppk(z[:900], z[:900], limits)
    assert few.reason == f"needs {LEAST_OF_MOMENTS}"
    assert "few trials dominate" in difference_of_ppk(z, z**7, limits).reason
    still = difference_of_ppk(z, np.full(4000, 1.0), limits)
    assert np.isnan(still.value) and "does not spread" in still.reason


def test_a_gap_in_the_interval_of_a_quantile_leaves_no_correlation():
    z = np.random.default_rng(8).normal(size=400)
    for far, known in ((0.0, False), (8.0, True)):  # of the largest 5 % of units
        both = [x + far * (z > 1.645) for x in (z, 0.9 * z)]
        a, b = (quantiles(x, [0.95])[0.95] for x in both)
        assert (correlation_of_quantiles(*both, (a, b)) == 0.0) == known
