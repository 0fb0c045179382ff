"""What deviations do to a planetary gear: axial forces, and backlash."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tolstat.machines.planetary.design import Design

Array = NDArray[np.float64]


def residual_axial_force(F: float, db2: Array, db3: Array, design: Design) -> Array:
    """Return the axial force that is left on a satellite, N.

    2T/dw2 tan(b2 + db2) - 2T/dw3 tan(b3 + db3), T the torque between its wheels. With
    tan(b + db) = tan b + sin db / (cos b cos(b + db)) what is in balance is exactly 0.

    Parameters
    ----------
    F : float
        Tangential force of a satellite in mesh 1-2, 2T/dw2, N.
    db2, db3 : float64[trial]
        Deviations of the helix angles, rad.
    design : Design
        The gear.
    """
    b2, b3, D = design.b2, design.b3, design.D
    at_2 = np.sin(db2) / (np.cos(b2) * np.cos(b2 + db2))
    at_3 = np.sin(db3) / (np.cos(b3) * np.cos(b3 + db3))
    left: Array = F * (design.unbalance + at_2 - D * at_3)
    return left


def backlash(E: tuple[Array, ...], da: Array, design: Design) -> Array:
    """Return the play of wheel 1, carrier and wheel 4 fixed, rad.

    Parameters
    ----------
    E : tuple of four float64[trial]
        Deviations of the tooth thicknesses of wheels 1, 2, 3, 4, m.
    da : float64[trial]
        Deviation of the centre distance, m; it opens an external mesh and closes an
        internal one.
    design : Design
        The gear.
    """
    E1, E2, E3, E4 = E
    s12, s34 = design.scheme
    jt12 = -(E1 + E2) + s12 * 2 * np.tan(design.alpha12) * da
    jt34 = -(E3 + E4) + s34 * 2 * np.tan(design.alpha34) * da
    j: Array = (jt12 + design.D * jt34) / (design.dw1 / 2)
    return j


def felt_in_mesh(design: Design) -> float:
    """Return what mesh 1-2 feels of a satellite's pin, moved by 1 along its orbit.

    The satellite rolls on wheel 4: its point in mesh 1-2 is dw2/2 from the pin, the
    point that stands still dw3/2, on the other side (AI) or on the same (AA, II).
    """
    return abs(1 - design.scheme.s12 * design.scheme.s34 * design.D)
