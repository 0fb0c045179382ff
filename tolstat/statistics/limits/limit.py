"""The limit of a response."""

import math
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, ndtri

from tolstat.arrays import Array, Integers, Truths
from tolstat.status import Status

DEMANDED = 0.9973  # yield if the study demands no other
ROUNDING = 1e-12  # of an end: that far beyond it, values lie on it
WORST = 10  # trials listed for a response with a limit
Ends = TypeVar("Ends", float, Array)


class Limit(NamedTuple):
    """The permitted values of a response, and the yield that is demanded.

    Attributes
    ----------
    lower, upper : float
        Least and greatest permitted value, SI; infinite if an end is open.
    demanded : float
        Demanded yield.
    words : str
        The values as the study writes them.
    demand : str
        The demand as the study writes it, "Ppk 1.33" or "2000 ppm"; empty for a yield.
    typed_ppk : float or None
        The Ppk of such a demand; None for any other.
    """

    lower: float
    upper: float
    demanded: float = DEMANDED
    words: str = ""
    demand: str = ""
    typed_ppk: float | None = None

    @property
    def permitted(self) -> tuple[float, float]:
        """Both ends."""
        return self.lower, self.upper

    @property
    def finite(self) -> list[float]:
        """The ends that are finite."""
        return [end for end in self.permitted if math.isfinite(end)]

    @property
    def ends(self) -> int:
        """Number of finite ends."""
        return len(self.finite)

    @property
    def asked(self) -> list[float]:
        """The finite ends that are not 0."""
        return [*filter(None, self.finite)]

    @property
    def ppk(self) -> float:
        """The demanded yield as the Ppk of a normal response."""
        if self.typed_ppk is not None:
            return self.typed_ppk
        return ppk_of(1 - self.demanded, self.ends)


NO_LIMIT = Limit(-math.inf, math.inf)


def rounded_out(lower: Ends, upper: Ends) -> tuple[Ends, Ends]:
    """Return permitted ends with room for rounding: 61 steps of 0.04 mm are 2.44 mm."""
    return lower - ROUNDING * abs(lower), upper + ROUNDING * abs(upper)


def within(values: Array, permitted: tuple[float, float]) -> Truths:
    """Return which values are permitted; the NaN of a failed trial is not."""
    lower, upper = rounded_out(*permitted)
    with np.errstate(invalid="ignore"):
        inside: Truths = (values >= lower) & (values <= upper)
    return inside


def margins(values: Array, permitted: tuple[float, float]) -> Array:
    """Return the distances of values within a limit; below 0 out of limit."""
    lower, upper = permitted
    return np.asarray(np.minimum(upper - values, values - lower))


def worst_trials(
    values: Array, status: NDArray[np.uint8], limit: Limit, count: int = WORST
) -> Integers:
    """Return the trials nearest to a limit, or farthest out of it; the worst first."""
    margin = margins(values, limit.permitted)
    margin[status != Status.DONE] = np.inf
    order = np.argsort(margin, kind="stable")[:count]
    return order[margin[order] < np.inf]


def yield_of_ppk(ppk: float, ends: int) -> float:
    """Return the yield of a normal response that has a Ppk at each end of its limit."""
    return float(1 - ends * ndtr(-3 * float(ppk)))


def ppk_of(beyond: float, ends: int) -> float:
    """Return the Ppk of a normal response with a share out of limit."""
    if beyond <= 0:
        return math.inf
    return float(-ndtri(min(beyond / ends, 1.0)) / 3)
