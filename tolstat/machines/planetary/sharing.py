"""Load sharing: satellites as equal springs that push and cannot pull."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Shares(NamedTuple):
    """How satellites share their load.

    Attributes
    ----------
    K : float64[trial]
        K_gamma, the largest force over the mean.
    forces : float64[trial, satellite]
        N; 0 without contact.
    """

    K: Array
    forces: Array


def shared(e: Array, F: float, c: float) -> Shares:
    """Share a load between satellites: sum over j of c max(0, X + e_j) = F.

    The satellite that stands out most touches first. The others follow in the order of
    their gaps to it, each once the load of those before has pressed them that far, as
    water fills a vessel with steps. So those in contact are counted, and the forces are
    exact: nothing is iterated.

    Parameters
    ----------
    e : float64[trial, satellite]
        Position errors, m; above 0 takes more load. Of any size: in the end one
        satellite carries all.
    F : float
        Tangential force of all satellites together, N, above 0.
    c : float
        Stiffness of a satellite, N/m, above 0.

    Notes
    -----
    All members are rigid and none floats. With all in contact,
    K_gamma = 1 + k c (max e - mean e) / F.
    """
    k = e.shape[1]
    gaps = e.max(axis=1, keepdims=True) - e
    steps = np.sort(gaps, axis=1)
    sums = np.cumsum(steps, axis=1)  # one after the other, whatever the other rows are
    # the n-th touches if the load presses those before it further than its step
    touching = np.arange(1, k + 1) * steps - sums < F / c
    m = np.count_nonzero(touching, axis=1)
    K = k / m * (1 + c / F * np.take_along_axis(sums, m[:, None] - 1, axis=1)[:, 0])
    K = np.minimum(K, float(k))  # but for rounding it is
    return Shares(K, F / k * np.maximum(K[:, None] - k * c / F * gaps, 0.0))
