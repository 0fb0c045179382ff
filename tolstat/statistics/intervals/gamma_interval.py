"""The gamma interval of a sum of weighted counts."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaincinv


def gamma_ends(
    counts: NDArray[np.float64], one_more: float, confidence: float = 0.95
) -> tuple[float, float]:
    """Return the ends of the interval of the expectation of a sum.

    Parameters
    ----------
    counts : float64[unit]
        What each counted unit adds to the sum.
    one_more : float
        What the next one might add; above 0.
    confidence : float
        Of the interval.

    References
    ----------
    M. P. Fay, E. J. Feuer, Confidence intervals for directly standardized rates,
    Statistics in Medicine 16 (1997) 791-801.
    """
    y, v = counts.sum(), np.sum(counts**2)
    miss = (1 - confidence) / 2
    lower = v / y * gammaincinv(y**2 / v, miss) if v > 0 else 0.0
    more, its_square = y + one_more, v + one_more**2
    shape, scale = more**2 / its_square, its_square / more
    return float(lower), float(scale * gammaincinv(shape, 1 - miss))
