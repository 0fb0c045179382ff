"""Intervals from leaving out a twentieth of the trials at a time."""

from __future__ import annotations

import numpy as np
from scipy.special import stdtrit

from tolstat.arrays import Array
from tolstat.statistics.estimate import Estimate

PARTS = 20
HEAVY = "no trustworthy interval: few trials dominate the variance"


def jackknifed(
    whole: Array, left_out: Array, confidence: float, *, trusted: bool = True
) -> list[Estimate]:
    """Give the interval of the jackknife to each number of float64[number].

    Student's, from float64[part, number] with one of `PARTS` parts left out. None where
    it is not trusted, because few trials dominate the variance.
    """
    if not trusted:
        return [Estimate(float(v), reason=HEAVY) for v in whole]
    scatter = np.mean((left_out - left_out.mean(axis=0)) ** 2, axis=0)
    z = float(stdtrit(PARTS - 1, 0.5 + confidence / 2))
    half = z * np.sqrt((PARTS - 1) * scatter)
    return [
        Estimate(float(v), float(v - h), float(v + h))
        for v, h in zip(whole, half, strict=True)
    ]
