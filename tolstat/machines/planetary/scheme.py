"""The schemes AA, II and AI: ratio, assembly, helix angles, where a gear can exist.

Wheel 1 meshes with wheel 2 of a satellite, its wheel 3 with wheel 4, which stands
still; the carrier H is driven. A is an external mesh, I an internal one. With s12 = 1
for an external mesh of 1 and 2 and -1 for an internal one, s34 the same of 3 and 4, one
formula holds for all three schemes.

Only the end of the source is printed; the rest was derived here. Its printing errors
are corrected: AA with D <= 1 begins at 1 - D, not 1 + D; AA with D >= 1 has 1 - s in
the denominator, not 1 - D s; (9) is z2 = z1 (1 - i - D) / (1 - D).

References
----------
Planetary gears AA, II, AI with helical wheels and balanced axial forces (2010, in
Russian), (7)-(11) and table 1.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from tolstat.arrays import Array
from tolstat.errors import ModelError, allowed_names

# possible teeth of each scheme, for three satellites and equal modules
EXAMPLES = {"AA": (30, 21, 25, 25), "II": (78, 26, 30, 81), "AI": (24, 36, 21, 84)}
MOST_SATELLITES = 24
SPUR = 1e-12  # kap is 1 but for rounding
# of a number of teeth: a whole number, or whole numbers in an array
Teeth = Any


class Scheme(NamedTuple):
    """The meshes 1-2 and 3-4: each 1 if external, -1 if internal."""

    s12: int
    s34: int


SCHEMES = {"AA": Scheme(1, 1), "II": Scheme(-1, -1), "AI": Scheme(1, -1)}


def ratio(scheme: Scheme, z1: Teeth, z2: Teeth, z3: Teeth, z4: Teeth) -> Any:
    """Return i, the speed of wheel 1 over the carrier's, wheel 4 at rest; (11)."""
    return 1 - scheme.s12 * scheme.s34 * (z2 * z4) / (z1 * z3)


def fourth(scheme: Scheme, i: float, z1: Teeth, z2: Teeth, z3: Teeth) -> Any:
    """Return z4 for a ratio, not rounded; (11)."""
    return scheme.s12 * scheme.s34 * (1 - i) * (z1 * z3) / z2


def diameter_ratio(scheme: Scheme, z1: Teeth, z2: Teeth, z3: Teeth, z4: Teeth) -> Any:
    """Return D = dw2 / dw3, which coaxiality leaves to the teeth alone.

    Both pairs have one centre distance, 2a = dw1 + s12 dw2 = dw4 + s34 dw3. The pitch
    diameters of a pair are proportional to its teeth, for any modules, helix angles and
    profile shifts.
    """
    return z2 * (z4 + scheme.s34 * z3) / (z3 * (z1 + scheme.s12 * z2))


def assembly(
    scheme: Scheme, k: int, z1: Teeth, z2: Teeth, z3: Teeth, z4: Teeth
) -> tuple[Any, Any]:
    """Return the dividend and the divisor of the condition of assembly; (8).

    k equal satellites can be assembled, equally spaced, if and only if the first is a
    multiple of the second. (8), z1 = k (P - Q x) / i with whole P and Q, is equivalent.
    """
    s = scheme.s12 * scheme.s34
    return z1 * z3 - s * z2 * z4, k * np.gcd(z2, z3)


def existence(scheme: str, D: ArrayLike, satellites: int) -> tuple[Array, Array]:
    """Return the ratios between which a gear exists.

    Wheel 2 has some size, and neighbouring satellites do not touch at their pitch
    circles: 2a sin(pi/k) > max(dw2, dw3).

    Parameters
    ----------
    scheme : str
        AA, II or AI.
    D : float or array of float
        dw2 / dw3, above 0.
    satellites : int
        k, 2 or more.

    Returns
    -------
    lower, upper : float64, as D
        The ratio lies between them, both excluded. One is infinite where two
        satellites, k = 2, never touch. Equal where no gear exists: AA, II with D = 1.

    Raises
    ------
    ModelError
        If D is not above 0, there are fewer than two satellites, or no such scheme.

    References
    ----------
    Table 1, corrected: see the file. Undercut and interference are not checked.
    """
    if scheme not in SCHEMES:
        raise ModelError(f"scheme = {scheme!r}: {allowed_names(str(scheme), SCHEMES)}")
    s12, s34 = SCHEMES[scheme]
    D = np.asarray(D, np.float64)
    if not np.all(D > 0):
        raise ModelError("D = dw2 / dw3 must be above 0")
    if satellites < 2 or satellites != int(satellites):
        raise ModelError(
            f"satellites = {satellites}: a whole number from 2 is expected"
        )
    s = np.sin(np.pi / satellites)
    # i = (1 - s12 s34 D) 2a / dw1: from no satellite, 2a = dw1, to where they touch
    least = 1 - s12 * s34 * D
    with np.errstate(divide="ignore", invalid="ignore"):
        most = np.where(least == 0, 0.0, least / (1 - s12 * s * np.minimum(D, 1.0)))
    return np.minimum(least, most), np.maximum(least, most)


class Helices(NamedTuple):
    """Helix angles of zero-shift wheels, each float64[design]."""

    kap: Array  # cos b2 / cos b3 that coaxial wheels have
    square: Array  # sin^2 b3; wheels exist where it lies between 0 and 1, 1 excluded
    b2: Array  # rad; NaN where there are none, 0 where spur wheels are coaxial
    b3: Array


def balanced(
    scheme: Scheme, mr: float, z1: Teeth, z2: Teeth, z3: Teeth, z4: Teeth
) -> Helices:
    """Return the helix angles that balance zero-shift wheels.

    mr is the normal module of wheels 1 and 2 over that of 3 and 4. Both rims of a
    satellite have one hand and one lead, tan b2 / tan b3 = D: then 2T/dw2 tan b2 =
    2T/dw3 tan b3. Coaxial wheels without profile shift have cos b2 / cos b3 = kap. Both
    together fix the angles.

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
        exists = (square >= 0) & (square < 1) & (sin_b2 < 1)
        b2 = np.arcsin(np.where(exists, sin_b2, np.nan))
        b3 = np.arcsin(np.where(exists, sin_b3, np.nan))
    return Helices(kap, square, b2, b3)


def unbalance(b2: Any, b3: Any, D: Any) -> Any:
    """Return the residual axial force on a satellite, for a force of 1 in mesh 1-2."""
    return np.tan(b2) - D * np.tan(b3)


class Design(NamedTuple):
    """A planetary gear without deviations, SI."""

    scheme: Scheme
    ratio: float
    D: float  # dw2/dw3
    b2: float  # helix angles at the pitch cylinders, rad
    b3: float
    dw1: float  # pitch diameters
    dw2: float
    dw3: float
    dw4: float
    a: float  # centre distance
    alpha12: float  # transverse pressure angles of the meshes, rad
    alpha34: float
    unbalance: float  # axial force on a satellite for 1 N in mesh 1-2; 0 if balanced
    F: float  # tangential force of all satellites together in mesh 1-2, N
