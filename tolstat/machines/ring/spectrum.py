"""Natural frequencies and growth of a ring over its speed, without force and tool."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tolstat.arrays import Array
from tolstat.errors import ModelError
from tolstat.machines.ring.declarations import description_of
from tolstat.machines.ring.linear import FASTEST, ring_eigenvalues
from tolstat.machines.ring.machine import Ring
from tolstat.machines.ring.parameters import build
from tolstat.model.settings import make


class Spectrum(NamedTuple):
    """The ring alone at each speed."""

    eigenvalues: NDArray[np.complex128]  # [speed, 4 (N - 1)], 1/s, as ring_eigenvalues
    frequency: Array  # [speed], omega_1, the lowest |Im|, rad/s; 0 also if overdamped
    growth: Array  # [speed], tau_1, the greatest Re, 1/s


def spectrum(speeds: ArrayLike, settings: Mapping[str, Any] | None = None) -> Spectrum:
    """Return natural frequencies and growth of the nominal ring over its speed.

    Without force and tool. Above 2 sqrt nu, where the lowest frequency is zero, no
    measurement validates it: hoop tension, left out unless `hoop` is set, keeps a real
    ring from it.

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
        If a setting is wrong, or a speed is not a number.

    References
    ----------
    A. I. Polunin (2012), Figs. 3 and 4.
    """
    chosen = make(Ring(), settings)
    Omega = np.atleast_1d(np.asarray(speeds, np.float64))
    if Omega.ndim != 1 or not (np.abs(Omega) <= FASTEST).all():
        raise ModelError(
            f"speeds: numbers in a row are expected, rad/s, at most {FASTEST:g}"
        )
    nominal = np.zeros((len(Omega), len(description_of(chosen).contributors)))
    values = ring_eigenvalues(build(nominal, chosen), Omega, chosen.hoop)
    return Spectrum(values, np.abs(values.imag).min(axis=1), values.real.max(axis=1))
