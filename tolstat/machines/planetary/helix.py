"""Helix angles with which the axial forces on a satellite cancel."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from tolstat.arrays import Array
from tolstat.machines.planetary.scheme import Scheme, Teeth

SPUR = 1e-12  # kap is 1 but for rounding


class Helices(NamedTuple):
    """Helix angles of zero-shift wheels.

    Attributes
    ----------
    kap : float64[design]
        cos b2 / cos b3 that coaxial wheels have.
    square : float64[design]
        sin^2 b3; wheels exist where it lies between 0 and 1, 1 excluded.
    b2, b3 : float64[design]
        Rad; NaN where there are no such angles, 0 where spur wheels are coaxial.
    """

    kap: Array
    square: Array
    b2: Array
    b3: Array


def balanced(
    scheme: Scheme, mr: float, z1: Teeth, z2: Teeth, z3: Teeth, z4: Teeth
) -> Helices:
    """Return the helix angles that the teeth of zero-shift wheels leave.

    Both rims of a satellite have one hand and one lead, tan b2 / tan b3 = D: then
    2T/dw2 tan b2 = 2T/dw3 tan b3. Coaxial wheels without profile shift have
    cos b2 / cos b3 = kap. Both together fix the angles.

    Parameters
    ----------
    scheme : Scheme
        Signs of its meshes.
    mr : float
        Normal module of wheels 1 and 2 over that of 3 and 4.
    z1, z2, z3, z4 : int or int64[design]
        Teeth.

    Notes
    -----
    With kap = 1 the wheels are spur wheels. With mr z2 = z3 besides, D = 1, any helix
    angle would do as well: such are taken as spur wheels too.
    """
    x = z2 / np.asarray(z3, np.float64)
    kap = mr * (z1 + scheme.s12 * z2) / (z4 + scheme.s34 * z3)
    spur = np.abs(kap - 1) < SPUR
    with np.errstate(divide="ignore", invalid="ignore"):
        square = np.where(spur, 0.0, (1 - kap**2) / ((mr * x) ** 2 - kap**2))
        sin_b3 = np.sqrt(square)
        sin_b2 = mr * x * sin_b3
        there = (square >= 0) & (square < 1) & (sin_b2 < 1)
        b2 = np.arcsin(np.where(there, sin_b2, np.nan))
        b3 = np.arcsin(np.where(there, sin_b3, np.nan))
    return Helices(kap, square, b2, b3)


def unbalance(b2: Any, b3: Any, D: Any) -> Any:
    """Return the axial force left on a satellite, for a force of 1 in mesh 1-2."""
    return np.tan(b2) - D * np.tan(b3)
