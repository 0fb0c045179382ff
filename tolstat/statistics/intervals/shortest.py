"""The shortest interval that holds a share of a sample."""

import math

import numpy as np

from tolstat.arrays import Array


def shortest_interval(values: Array, share: float) -> tuple[float, float]:
    """Return the ends of the shortest interval with at least a share of the values.

    NaN for a sample without values. Of a symmetric distribution it lies between
    quantiles that are as far from either end.

    References
    ----------
    JCGM 101:2008, 7.7.4: the shortest coverage interval.
    """
    ordered = np.sort(values)
    count = math.ceil(share * len(ordered))
    if not count:
        return math.nan, math.nan
    first = int(np.argmin(ordered[count - 1 :] - ordered[: len(ordered) - count + 1]))
    return float(ordered[first]), float(ordered[first + count - 1])
