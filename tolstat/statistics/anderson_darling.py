"""The statistic of Anderson and Darling, and its level when parameters are fitted."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def a_squared(log_below: Array, log_over: Array) -> float:
    """Return A squared of ascending values.

    Parameters
    ----------
    log_below, log_over : float64[n]
        Logarithms of the shares below and over each, as the distribution has them.
    """
    n = len(log_below)
    weight = 2 * np.arange(1, n + 1) - 1
    return float(-n - np.mean(weight * (log_below + log_over[::-1])))


def log_of_the_rest(log_share: Array) -> Array:
    """Return the logarithm of what a share, given by its logarithm, leaves of 1."""
    return np.log(np.maximum(-np.expm1(log_share), 1e-300))


def level_in(
    statistic: float, critical: Sequence[float], levels: Sequence[float]
) -> float:
    """Interpolate the level (p-value) of a statistic in a table; its ends are kept.

    Parameters
    ----------
    statistic : float
        A squared.
    critical, levels : sequence of float
        Values that are exceeded with these probabilities, ascending.
    """
    return float(np.exp(np.interp(statistic, critical, np.log(levels))))
