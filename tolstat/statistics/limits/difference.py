"""Differences of two designs: yields, quantiles and Ppk, paired or not."""

import math
from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array, Truths
from tolstat.statistics.estimate import CONFIDENCE, Estimate, Lack, NoInterval
from tolstat.statistics.intervals.as_sampled import (
    HEAVY,
    PARTS,
    few_dominate,
    jackknifed,
    spreads,
)
from tolstat.statistics.intervals.replicates import WIDER
from tolstat.statistics.intervals.shares import proportion
from tolstat.statistics.limits.limit import Limit
from tolstat.statistics.summary import MOST_PPK, NO_SPREAD

LEAST_OF_MOMENTS = 1000  # trials from which Ppk by moments is compared
MOST_CORRELATED = 0.9  # above, the ends of both are too ragged to be subtracted
MOST_STEP = 1 / 3  # of the interval of a quantile, from one unit to the next


class Exchange(NamedTuple):
    """Units that change sides of a limit between two designs."""

    # units within in the first design, out of limit in the second; the reverse
    worse: int
    better: int
    # share out of limit in the second design less the share in the first
    out_of_limit: Estimate


def exchange(first: Truths, second: Truths) -> Exchange:
    """Compare which units are within, trial by trial.

    The interval is exact. The difference of yields is the share that changes sides,
    times the fraction worse less better of these. Both factors have intervals of
    Clopper and Pearson, each with half the error. The second is conditional on the
    number that changes sides, as in McNemar's test.

    Parameters
    ----------
    first, second : bool[trial]
        Whether each unit is within, in either design; trials are independent.

    References
    ----------
    Q. McNemar, Psychometrika 12 (1947) 153-157; C. J. Clopper, E. S. Pearson,
    Biometrika 26 (1934) 404-413.
    """
    worse = int(np.count_nonzero(first & ~second))
    better = int(np.count_nonzero(~first & second))
    changed, half = worse + better, 1 - (1 - CONFIDENCE) / 2
    share = proportion(changed, len(first), half)
    lean = (-1.0, 1.0)
    if changed:
        of_these = proportion(worse, changed, half)
        lean = (2 * of_these.lower - 1, 2 * of_these.upper - 1)
    ends = [s * by for s in (share.lower, share.upper) for by in lean]
    value = (worse - better) / len(first)
    return Exchange(worse, better, Estimate(value, min(ends), max(ends)))


def difference(first: Estimate, second: Estimate, correlation: float = 0.0) -> Estimate:
    """Return the second design's number less the first's, with an interval.

    Both intervals are combined by squares, end by end, with the correlation of their
    errors: 0 for independent trials. If a number is infinite, the ends are subtracted;
    that interval holds for any correlation. None where it has no finite end.

    References
    ----------
    G. Y. Zou, A. Donner, Statistics in Medicine 27 (2008) 1693-1702; for shares R. G.
    Newcombe's, Statistics in Medicine 17 (1998) 873-890.
    """
    a, b = first, second
    if not (a.sure and b.sure):
        value = b.value - a.value if math.isfinite(a.value + b.value) else math.nan
        return Estimate(value, reason=a.reason or b.reason)
    if math.isinf(a.value) and math.isinf(b.value):
        return Estimate(math.nan, reason=NoInterval(Lack.ANY_OUT))
    value = b.value - a.value
    if a.upper == b.upper == math.inf:
        finite = value if math.isfinite(value) else math.nan
        return Estimate(finite, reason=NoInterval(Lack.ENDS))
    if math.isinf(value):
        return Estimate(value, b.lower - a.upper, b.upper - a.lower)

    def half(x: float, y: float) -> float:
        if math.isinf(x + y):
            return math.inf
        return math.sqrt(max(x**2 + y**2 - 2 * correlation * x * y, 0.0))

    lower = value - half(b.value - b.lower, a.upper - a.value)
    upper = value + half(b.upper - b.value, a.value - a.lower)
    return Estimate(value, lower, upper)


def correlation_of_shares(first: Truths, second: Truths) -> float:
    """Return the correlation of the errors of two shares of the same trials.

    Two units with the property in one design only are added, because the number of such
    units is uncertain. At most 0.9.
    """
    n = len(first) + 2
    both = np.count_nonzero(first & second)
    # not NumPy's integers: the product of four may pass 2^63
    a, b = (int(np.count_nonzero(units)) + 1 for units in (first, second))
    spread = a * (n - a) * b * (n - b)
    return min((n * both - a * b) / math.sqrt(spread), MOST_CORRELATED)


def correlation_of_quantiles(
    first: Array, second: Array, quantiles: tuple[Estimate, Estimate]
) -> float:
    """Return the correlation of the errors of a quantile of two paired designs.

    0 if one step between neighbouring units takes up a third of an interval, as ties
    and gaps make it: that interval is no measure of the error.
    """
    a, b = quantiles
    for values, (_, lower, upper, _) in ((first, a), (second, b)):
        steps = np.diff(np.sort(values[(values >= lower) & (values <= upper)]))
        tied = any(np.count_nonzero(values == end) > 1 for end in (lower, upper))
        if tied or steps.max(initial=0.0) > MOST_STEP * (upper - lower):
            return 0.0
    return correlation_of_shares(first <= a.value, second <= b.value)


def difference_of_ppk(
    first: Array, second: Array, limits: tuple[Limit, Limit]
) -> Estimate:
    """Return the difference of Ppk by moments, from mean and sigma.

    It is second less first, with the interval of a jackknife that leaves out a
    twentieth of both at a time, a tenth wider; none if few trials dominate a variance.

    Parameters
    ----------
    first, second : float64[trial]
        The response in either design, of trials that are done: the same trials in the
        same order, or independent trials.
    """
    trials = min(len(first), len(second))
    if trials < LEAST_OF_MOMENTS:
        return Estimate(
            math.nan, reason=NoInterval(Lack.TRIALS, needed=LEAST_OF_MOMENTS)
        )
    if not (spreads(first) and spreads(second)):
        return NO_SPREAD
    a, b = (_ppk(x, limit) for x, limit in zip((first, second), limits, strict=True))
    if max(a[0], b[0]) > MOST_PPK:
        return NO_SPREAD
    if few_dominate(first) or few_dominate(second):
        return Estimate(float(b[0] - a[0]), reason=HEAVY)
    (change,) = jackknifed((b - a)[:, None])
    half = WIDER * (change.upper - change.value)  # of skewed responses: not normal
    return Estimate(change.value, change.value - half, change.value + half)


def _ppk(values: Array, limit: Limit) -> Array:
    """Return Ppk by moments of all trials, and with each part left out."""
    centre = float(values.mean())
    x, part = values - centre, np.arange(len(values)) % PARTS
    sums = (np.bincount(part, power) for power in (np.ones(len(x)), x, x**2))
    n, first, second = (s.sum() - np.append(0.0, s) for s in sums)
    mean = first / n
    sigma = np.sqrt(np.maximum(second - n * mean**2, 0.0) / (n - 1))
    margin = np.minimum(limit.upper - centre - mean, centre + mean - limit.lower)
    with np.errstate(divide="ignore", invalid="ignore"):  # one unit that differs
        return np.asarray(margin / (3 * sigma), np.float64)
