"""The schemes AA, II and AI: ratio, coaxiality, assembly, where a gear can exist.

Wheel 1 meshes with wheel 2 of a satellite, its wheel 3 with wheel 4, which stands
still; the carrier H is driven. A is an external mesh, I an internal one. With s12 = 1
for an external mesh of 1 and 2 and -1 for an internal one, s34 the same of 3 and 4, one
formula holds for all three schemes.

Of the source only the end is printed; what it leaves out was derived, and its printing
errors are corrected: AA with D <= 1 begins at 1 - D, not 1 + D; AA with D >= 1 has
1 - s in the denominator, not 1 - D s; (9) is z2 = z1 (1 - i - D) / (1 - D).

References
----------
Planetary gears AA, II, AI with helical wheels and balanced axial forces (2010, in
Russian), (7)-(11) and table 1.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from tolstat.arrays import Array
from tolstat.errors import ModelError, allowed_names

# of a number of teeth: a whole number, or whole numbers in an array
Teeth = Any


class Scheme(NamedTuple):
    """The meshes 1-2 and 3-4: each 1 if external, -1 if internal."""

    s12: int
    s34: int


SCHEMES = {"AA": Scheme(1, 1), "II": Scheme(-1, -1), "AI": Scheme(1, -1)}


def scheme_of(name: str) -> Scheme:
    """Return a scheme by its name.

    Raises
    ------
    ModelError
        If there is none of that name.
    """
    if name not in SCHEMES:
        raise ModelError(f"scheme = {name!r}: {allowed_names(str(name), SCHEMES)}")
    return SCHEMES[name]


def ratio(scheme: Scheme, z1: Teeth, z2: Teeth, z3: Teeth, z4: Teeth) -> Any:
    """Return i, the speed of wheel 1 over the carrier's, wheel 4 at rest; (11)."""
    return 1 - scheme.s12 * scheme.s34 * (z2 * z4) / (z1 * z3)


def fourth(scheme: Scheme, i: float, z1: Teeth, z2: Teeth, z3: Teeth) -> Any:
    """Return z4 for a ratio, no whole number; (11)."""
    return scheme.s12 * scheme.s34 * (1 - i) * (z1 * z3) / z2


def diameter_ratio(scheme: Scheme, z1: Teeth, z2: Teeth, z3: Teeth, z4: Teeth) -> Any:
    """Return D = dw2 / dw3, which coaxiality leaves to the teeth alone.

    Both pairs have one centre distance, 2a = dw1 + s12 dw2 = dw4 + s34 dw3, and the
    pitch diameters of a pair are as its teeth, whatever modules, helix angles and
    profile shifts are.
    """
    return z2 * (z4 + scheme.s34 * z3) / (z3 * (z1 + scheme.s12 * z2))


def assembly(
    scheme: Scheme, k: int, z1: Teeth, z2: Teeth, z3: Teeth, z4: Teeth
) -> tuple[Any, Any]:
    """Return what has to be divided, and by what, for k satellites to be put in; (8).

    k satellites that are all alike can be put in, equally spaced, if and only if the
    first is a multiple of the second. (8), z1 = k (P - Q x) / i with whole P and Q,
    says the same.
    """
    s = scheme.s12 * scheme.s34
    return z1 * z3 - s * z2 * z4, k * np.gcd(z2, z3)


def existence(scheme: str, D: ArrayLike, satellites: int) -> tuple[Array, Array]:
    """Return between which ratios a gear exists.

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
    Table 1, corrected: see the file. Undercut and interference are not looked at.
    """
    s12, s34 = scheme_of(scheme)
    D = np.asarray(D, np.float64)
    if not np.all(D > 0):
        raise ModelError("D = dw2 / dw3 is above 0")
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
