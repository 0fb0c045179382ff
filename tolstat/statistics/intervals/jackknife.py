"""Intervals from leaving out a twentieth of the trials at a time."""

import numpy as np
from scipy.special import stdtrit

from tolstat.arrays import Array
from tolstat.statistics.estimate import CONFIDENCE, Estimate
from tolstat.statistics.reason import Lack, Reason

PARTS = 20
HEAVY = Reason(Lack.LIGHT_TAILS)


def jackknifed(
    numbers: Array, without: Array, *, trusted: bool = True
) -> list[Estimate]:
    """Return the numbers of float64[number] with jackknife intervals.

    `without` is float64[part, number], each without one of `PARTS` parts; the interval
    is Student's. There is none if not `trusted`: few trials dominate the variance.
    """
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
