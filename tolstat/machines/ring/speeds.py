"""The linear ring over its speed, from Python: frequencies and growth."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tolstat.arrays import Array
from tolstat.errors import ModelError
from tolstat.machines.ring.declarations import description_of
from tolstat.machines.ring.linear import ring_eigenvalues
from tolstat.machines.ring.parameters import build

FASTEST = 1e6  # rad/s


class Spectrum(NamedTuple):
    """The ring alone at each speed.

    Attributes
    ----------
    eigenvalues : complex128[speed, 4 (N - 1)]
        1/s, ascending by |Im|, then by Re.
    frequency : float64[speed]
        omega_1, the lowest |Im|, rad/s; 0 where a mode is overdamped, too.
    growth : float64[speed]
        tau_1, the greatest Re, 1/s.
    """

    eigenvalues: NDArray[np.complex128]
    frequency: Array
    growth: Array


def spectrum(speeds: ArrayLike, settings: Mapping[str, Any] | None = None) -> Spectrum:
    """Return natural frequencies and growth of the nominal ring over its speed.

    Without force and tool. Beyond 2 sqrt nu, where the lowest frequency is zero, it is
    not validated by any measurement: hoop tension, left out unless `hoop` is set, keeps
    a real ring from it.

    Parameters
    ----------
    speeds : float64[speed]
        rad/s, zero and below too.
    settings : mapping, optional
        Of the ring, SI, by name: radius, thickness, support_angle, ring_damping,
        harmonics, hoop, ...; the others take their defaults.

    Raises
    ------
    ModelError
        If a setting is wrong, or a speed is no number.

    References
    ----------
    A. I. Polunin (2012), Figs. 3 and 4.
    """
    from tolstat.machines.ring.machine import Ring
    from tolstat.model.settings import make

    chosen = make(Ring(), settings)
    Omega = np.atleast_1d(np.asarray(speeds, np.float64))
    if Omega.ndim != 1 or not (np.abs(Omega) <= FASTEST).all():
        raise ModelError(
            f"speeds: numbers in a row are expected, rad/s, none beyond {FASTEST:g}"
        )
    nominal = np.zeros((len(Omega), len(description_of(chosen).contributors)))
    found = ring_eigenvalues(build(nominal, chosen), Omega, chosen.hoop)
    return Spectrum(found, np.abs(found.imag).min(axis=1), found.real.max(axis=1))
