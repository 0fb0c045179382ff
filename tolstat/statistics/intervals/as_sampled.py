"""Intervals as sampled: they hold if no rarer kind of trial exists than those seen.

They come from leaving out a twentieth of the trials at a time, or from mean and sigma.
"""

import math

import numpy as np
from scipy.special import stdtrit

from tolstat.arrays import Array, Integers
from tolstat.statistics.estimate import CONFIDENCE, Estimate, Lack, NoInterval
from tolstat.statistics.intervals.moments import few_leave

PARTS = 20
HEAVY = NoInterval(Lack.LIGHT_TAILS)


def jackknifed(table: Array, *, trusted: bool = True) -> list[Estimate]:
    """Return numbers with jackknife intervals.

    The first row of `table` has the numbers of all trials, the next ones those without
    each of `PARTS` parts. The interval is Student's. There is none if not `trusted`:
    few trials dominate the variance.
    """
    numbers, without = table[0], table[1:]
    if not trusted:
        return [Estimate(float(v), reason=HEAVY) for v in numbers]
    scatter = np.mean((without - without.mean(axis=0)) ** 2, axis=0)
    z = float(stdtrit(PARTS - 1, 0.5 + CONFIDENCE / 2))
    half = z * np.sqrt((PARTS - 1) * scatter)
    return [
        Estimate(float(v), float(v - h), float(v + h))
        for v, h in zip(numbers, half, strict=True)
    ]


def spreads(values: Array) -> bool:
    """Return whether float64[n] differ by more than the rounding of their mean."""
    return bool(values.std(ddof=1) > 1e-14 * abs(values.mean()))


LEAST_TRIALS = 50  # trials from which there is an interval
MOST_SKEWED = 0.6  # gamma over the root of n; 1 over the root of the trials that count
OF_REPLICATES = 0.2, 1.1  # the same with replicates, and how much wider Student's is
WIDER = 3.0  # times the square of that: a sample understates heavy tails


def mean_as_sampled(
    values: Array, confidence: float = 0.95, replicate: Integers | None = None
) -> Estimate:
    """Estimate the mean of float64[n] trials.

    The interval is Student's, corrected for the skewness gamma, and wider by 3
    gamma^2/n. There is none if |gamma| > 0.6 sqrt(n): about three trials decide the
    mean. With replicates, whose scatter counts then, it is a tenth wider, and the bound
    is 0.2.

    Parameters
    ----------
    replicate : int64[n], optional
        Number of the independent randomisation that each trial belongs to; without it
        trials are independent.

    References
    ----------
    P. Hall, On the removal of skewness by transformation, J. R. Statist. Soc. B 54
    (1992) 221-228.
    """
    n = len(values)
    value = float(values.mean()) if n else math.nan
    if n < LEAST_TRIALS:
        return Estimate(value, reason=NoInterval(Lack.TRIALS, needed=LEAST_TRIALS))
    g, dependent = skewness(values), replicate is not None
    most, wider = OF_REPLICATES if dependent else (MOST_SKEWED, 1.0)
    if not abs(g) <= most:
        return Estimate(value, reason=HEAVY)
    size = float(np.abs(values).max())  # squares of others may not be finite
    scaled = values / size
    if replicate is not None:
        scaled = np.bincount(replicate, scaled) / np.bincount(replicate)
    error = size * float(scaled.std(ddof=1)) / math.sqrt(len(scaled))
    student = float(stdtrit(len(scaled) - 1, 0.5 + confidence / 2))
    t = wider * (1 + WIDER * g**2) * student
    lower, upper = (value - error * _quantile(x, g) for x in (t, -t))
    return Estimate(value, lower, upper)


def sigma_as_sampled(
    values: Array, confidence: float = 0.95, replicate: Integers | None = None
) -> Estimate:
    """Estimate the standard deviation by the mean of squares: see `mean_as_sampled`."""
    n = len(values)
    too_few = NoInterval(Lack.TRIALS, needed=LEAST_TRIALS) if n < LEAST_TRIALS else None
    if reason := too_few or few_leave(values):
        return Estimate(float(values.std(ddof=1)) if n > 1 else math.nan, reason=reason)
    deviations = values - values.mean()
    size = float(np.abs(deviations).max()) or 1.0
    squares = (deviations / size) ** 2 * (n / (n - 1))
    mean_square = mean_as_sampled(squares, confidence, replicate)
    value, lower, upper = (math.sqrt(max(x, 0.0)) for x in mean_square[:3])
    return Estimate(value, lower, upper, mean_square.reason).times(size)


def few_dominate(values: Array) -> bool:
    """Return whether few of float64[n] trials decide the variance."""
    return not abs(skewness((values - values.mean()) ** 2)) <= MOST_SKEWED


def skewness(values: Array) -> float:
    """Return the skewness of float64[n] over the root of n; NaN without spread.

    It is 1 if one trial carries all of the spread to one side, and about 1/sqrt(k) if
    k trials do.
    """
    deviations = values - values.mean()
    largest = float(np.abs(deviations).max())
    if not largest > 1e-14 * abs(float(values.mean())):
        return math.nan
    deviations /= largest
    squares = deviations * deviations
    return float(squares @ deviations / squares.sum() ** 1.5)


def _quantile(x: float, g: float) -> float:
    """Return the quantile of Student's ratio at a normal one, for a skewed response.

    The inverse of Hall's polynomial T + g T^2/3 + g^2 T^3/27 + g/6.
    """
    if abs(g) < 1e-6:
        return x
    return 3 / g * (math.cbrt(1 + g * (x - g / 6)) - 1)
