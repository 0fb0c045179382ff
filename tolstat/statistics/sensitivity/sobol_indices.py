"""First-order and total Sobol' indices from trials sampled for them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.intervals.jackknife import PARTS, jackknifed, tails_are_light

LEAST = 500  # groups from which indices are given


class Indices(NamedTuple):
    """Shares of the variance due to a factor: alone, and with all interactions."""

    first: Estimate
    total: Estimate


def sobol_indices(groups: Array, factors: Sequence[str]) -> dict[str, Indices]:
    """Estimate the Sobol' indices of a response, with a jackknife over groups.

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
        reason = f"needs {LEAST} groups of {group} trials, {LEAST * group} in all"
        if n and np.ptp(groups[:, :2]) == 0:
            reason = "the response does not spread"
        none = Estimate(math.nan, reason=reason)
        return dict.fromkeys(factors, Indices(none, none))
    # an offset adds only noise to the first order
    f = groups - groups[:, :2].mean()
    A, B, AB = f[:, 0], f[:, 1], f[:, 2:]
    sums = np.column_stack(
        [B[:, None] * (AB - A[:, None]), (A[:, None] - AB) ** 2 / 2, A, B, A**2, B**2]
    )
    parts = np.array([sums[p::PARTS].sum(axis=0) for p in range(PARTS)])
    sizes = np.array([len(sums[p::PARTS]) for p in range(PARTS)])
    whole = parts.sum(axis=0)
    value = _ratios(whole, n)
    left_out = np.array(
        [
            _ratios(whole - part, n - size)
            for part, size in zip(parts, sizes, strict=True)
        ]
    )
    light = tails_are_light(groups[:, :2].ravel())
    found = jackknifed(value, left_out, trusted=light)
    k = len(factors)
    return {name: Indices(found[i], found[k + i]) for i, name in enumerate(factors)}


def _ratios(sums: Array, n: int) -> Array:
    """Divide the numerators of first and total indices by the variance."""
    a, b, aa, bb = sums[-4:]
    variance = (aa + bb) / (2 * n) - ((a + b) / (2 * n)) ** 2
    return np.asarray(sums[:-4] / n / variance)
