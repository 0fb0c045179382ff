"""First-order and total Sobol' indices from trials sampled for them."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.intervals.jackknife import PARTS, jackknifed
from tolstat.statistics.reason import Lack, Reason
from tolstat.statistics.sensitivity.clipping import clipped, few_leave_a_point_mass

LEAST = 500  # groups from which indices are given


class Indices(NamedTuple):
    """Shares of the variance due to a factor: alone, and with all interactions."""

    first: Estimate
    total: Estimate


def sobol_indices(groups: Array, factors: Sequence[str]) -> dict[str, Indices]:
    """Estimate the Sobol' indices of a response, with a jackknife over groups.

    If few trials may dominate the variance, the response is clipped: see `clipped`.

    Parameters
    ----------
    groups : float64[group, 2 + factor]
        The response of trials A and B, and of A with one factor from B; none NaN.

    References
    ----------
    A. Saltelli et al., Computer Physics Communications 181 (2010) 259-270, table 2: (b)
    for the first order; (f), after Jansen, for the total.
    """
    n = len(groups)
    if n < LEAST or np.ptp(groups[:, :2]) == 0:
        group = groups.shape[1]
        needed = {"needed": LEAST, "size": group, "trials": LEAST * group}
        reason = Reason(Lack.GROUPS, **needed)
        if n and np.ptp(groups[:, :2]) == 0:
            reason = Reason(Lack.SPREAD)
        none = Estimate(math.nan, reason=reason)
        return dict.fromkeys(factors, Indices(none, none))
    first_two = groups[:, :2]
    core, is_sparse = (
        clipped(groups, first_two),
        few_leave_a_point_mass(first_two.ravel()),
    )
    part = np.arange(n) % PARTS
    without = np.array([_indices(core.values[part != p]) for p in range(PARTS)])
    without = core.followed(without, _indices)
    estimates = jackknifed(_indices(core.values), without, trusted=not is_sparse)
    k = len(factors)
    return {
        name: Indices(estimates[i], estimates[k + i]) for i, name in enumerate(factors)
    }


def _indices(groups: Array) -> Array:
    """Return first and total indices: float64[2 factors]."""
    # an offset adds only noise to the first order
    f = groups - groups[:, :2].mean()
    A, B, AB = f[:, 0], f[:, 1], f[:, 2:]
    first, total = B @ (AB - A[:, None]), np.sum((A[:, None] - AB) ** 2, axis=0) / 2
    return np.asarray(np.append(first, total) / len(f) / f[:, :2].var())
