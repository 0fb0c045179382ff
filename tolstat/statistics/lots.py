"""Sigma within and between lots, and how uncertain few lots leave the mean of parts.

Parts of one lot lie beside those of others, so the mean of parts is as uncertain as
that of their lots.

References
----------
R. K. Burdick, F. A. Graybill, Confidence Intervals on Variance Components, Dekker 1992:
modified large sample intervals of a sum of variances.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.special import chdtri

from tolstat.arrays import Array
from tolstat.statistics.estimate import CONFIDENCE

TAIL = (1 - CONFIDENCE) / 2


class LotEffect(NamedTuple):
    """Lots whose means differ by more than their parts explain; numbers are SI."""

    lots: int
    between: float  # sigma of the means of lots
    within: float  # sigma within lots
    of_mean: float  # sigma of the mean of all parts
    freedom: float  # degrees of freedom that the sigma of all parts is worth
    parts_per_lot: float

    @property
    def of_lots(self) -> float:
        """What the lots add to the sigma of the mean of all parts."""
        return self.between / math.sqrt(self.lots)

    @property
    def correlation(self) -> float:
        """Intraclass correlation: of two parts of one lot."""
        between = self.between**2
        return between / (between + self.within**2)

    @property
    def design_effect(self) -> float:
        """How many parts tell as much of a share as one of a lot of its own."""
        return 1 + (self.parts_per_lot - 1) * self.correlation


def by_lot(values: Array, lots: Sequence[str]) -> dict[str, Array]:
    """Return the parts of each lot, in the order of the lots; none without lots."""
    names = np.array(lots)
    return {lot: values[names == lot] for lot in dict.fromkeys(lots)}


def sigma_within(values: Array, lots: Sequence[str]) -> tuple[float, int]:
    """Return the pooled sigma within lots, and its degrees of freedom; 0 without."""
    groups = by_lot(values, lots).values()
    freedom = len(values) - len(groups)
    if len(groups) < 2 or freedom < 1:
        return math.nan, 0
    squares = sum(float(((group - group.mean()) ** 2).sum()) for group in groups)
    return math.sqrt(squares / freedom), freedom


def lot_effect(values: Array, lots: Sequence[str]) -> LotEffect | None:
    """Return how lots differ; None if their parts explain it, or all are alone."""
    within, freedom = sigma_within(values, lots)
    if not freedom:
        return None
    groups = by_lot(values, lots).values()
    sizes = np.array([len(group) for group in groups])
    single = float(np.mean(1 / sizes))  # of a part's variance, in the mean of a lot
    means = float(np.var([group.mean() for group in groups], ddof=1))
    between = means - single * within**2
    if not between > 0:
        return None
    shares = float((sizes**2).sum()) / len(values)
    variance = between * shares / len(values) + within**2 / len(values)
    degrees = _freedom(
        (means, (1 - single) * within**2), (len(groups) - 1, freedom), len(values) - 1
    )
    return LotEffect(
        len(groups), math.sqrt(between), within, math.sqrt(variance), degrees, shares
    )


def _freedom(
    variances: tuple[float, float], freedoms: tuple[int, int], most: int
) -> float:
    """Return degrees of freedom that give a sum of variances its upper end."""
    from scipy.optimize import brentq  # slow to import, and seldom needed

    def upper(freedom: float) -> float:
        return freedom / float(chdtri(freedom, 1 - TAIL))

    beyond = math.hypot(
        *((upper(f) - 1) * v for v, f in zip(variances, freedoms, strict=True))
    )
    ratio = 1 + beyond / sum(variances)
    fewest = min(freedoms)
    if ratio >= upper(fewest):
        return fewest
    return most if ratio <= upper(most) else brentq(
        lambda freedom: upper(freedom) - ratio, fewest, most
    )  # fmt: skip
