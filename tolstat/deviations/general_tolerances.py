"""ISO 2768-1: general tolerances of a drawing, "ISO 2768-m", by class and size.

References
----------
ISO 2768-1:1989, Tables 1 (linear sizes), 2 (external radii, heights of chamfers) and 3
(angles, by the length of the shorter side).
"""

import re
from bisect import bisect_left
from math import inf, pi

from tolstat.deviations.distributions import Tolerance
from tolstat.errors import GradeError

_WRITTEN = re.compile(r"ISO\s*2768(?:-1)?\s*-\s*([fmcv])[HKL]?(\s+radius)?")
DEGREE = pi / 180
# upper ends of ranges of sizes, mm, and half the zone by class; None: not given
Table = tuple[tuple[float, ...], dict[str, tuple[float | None, ...]]]
LENGTHS: Table = (
    (3, 6, 30, 120, 400, 1000, 2000, 4000),
    {
        "f": (0.05, 0.05, 0.1, 0.15, 0.2, 0.3, 0.5, None),
        "m": (0.1, 0.1, 0.2, 0.3, 0.5, 0.8, 1.2, 2),
        "c": (0.2, 0.3, 0.5, 0.8, 1.2, 2, 3, 4),
        "v": (None, 0.5, 1, 1.5, 2.5, 4, 6, 8),
    },
)
RADII: Table = (
    (3, 6, inf),
    {"f": (0.2, 0.5, 1), "m": (0.2, 0.5, 1), "c": (0.4, 1, 2), "v": (0.4, 1, 2)},
)
ANGLES: Table = (  # minutes of arc
    (10, 50, 120, 400, inf),
    {
        "f": (60, 30, 20, 10, 5),
        "m": (60, 30, 20, 10, 5),
        "c": (90, 60, 30, 15, 10),
        "v": (180, 120, 60, 30, 20),
    },
)
LEAST = 0.5  # mm, of lengths and radii


def general_class(text: str) -> tuple[str, bool] | None:
    """Return the class of a general tolerance, and whether it is of a radius."""
    match = _WRITTEN.fullmatch(text.strip())
    return (match[1], bool(match[2])) if match else None


def general_zone(text: str, size: float, unit: str = "m") -> Tolerance:
    """Return the zone of a general tolerance, SI, of a length or an angle.

    Parameters
    ----------
    text : str
        As on a drawing, "ISO 2768-m" or "ISO 2768-mK"; "ISO 2768-m radius" is of an
        external radius or a chamfer.
    size : float
        Nominal size, m; of an angle the length of its shorter side.
    unit : str
        "m" or "rad".

    Raises
    ------
    GradeError
        If the standard has none of this size.
    """
    name, is_radius = general_class(text) or ("", False)
    ends, halves = ANGLES if unit == "rad" else RADII if is_radius else LENGTHS
    millimetres = round(1e3 * size, 9)
    step = bisect_left(ends, millimetres)
    small = unit == "m" and millimetres < LEAST
    half = None if small or step == len(ends) else halves[name][step]
    if half is None:
        raise GradeError(
            f"'{text}' of {millimetres:g} mm: ISO 2768-1 has none; give the tolerance"
        )
    half *= DEGREE / 60 if unit == "rad" else 1e-3
    return Tolerance(-half, half)
