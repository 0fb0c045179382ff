"""ISO 1328-1:2013: flank tolerance classes of cylindrical gears.

The edition of 1995 rounded the diameter and the module to ranges first; classes of the
two editions do not give the same values.

References
----------
ISO 1328-1:2013, 5.2 (rounding), 5.3.2 (single pitch), annex E (run-out, informative:
nine tenths of the total cumulative pitch deviation).
"""

from __future__ import annotations

import math

from tolstat.deviations.tolerance import Tolerance
from tolstat.errors import GradeError

EDITION = "ISO 1328-1:2013"
CLASSES = range(1, 12)


def _rounded(micrometres: float) -> float:
    """Round as 5.2 says: to 1 um above 10 um, to 0.5 um above 5 um, else to 0.1 um."""
    step = 1.0 if micrometres > 10 else 0.5 if micrometres > 5 else 0.1
    return step * math.floor(micrometres / step + 0.5)


def _checked(diameter: float, module: float, flank_class: int) -> tuple[float, float]:
    """Return diameter and module, mm, if the standard covers them."""
    d, m = 1e3 * diameter, 1e3 * module
    if flank_class not in CLASSES:
        raise GradeError(f"class {flank_class}: {EDITION} has the classes 1 to 11")
    if not 0.5 <= m <= 70:
        raise GradeError(f"module {m:g} mm: {EDITION} covers 0.5 to 70 mm")
    if not 5 <= d / m <= 1000:
        raise GradeError(
            f"module {m:g} mm: a wheel of {d:g} mm would have {d / m:.1f} teeth; "
            f"{EDITION} covers 5 to 1000"
        )
    if not 5 <= d <= 15000:
        raise GradeError(f"diameter {d:g} mm: {EDITION} covers 5 to 15000 mm")
    return d, m


def single_pitch(diameter: float, module: float, flank_class: int) -> float:
    """Return the tolerance of the single pitch deviation, f_pT.

    Parameters
    ----------
    diameter, module : float
        Reference diameter and normal module, m.
    flank_class : int
        1 to 11.

    Returns
    -------
    float
        m; the deviation may be as much to either side.

    Raises
    ------
    GradeError
        If the standard does not cover them.
    """
    d, m = _checked(diameter, module, flank_class)
    f_pT = (0.001 * d + 0.4 * m + 5) * math.sqrt(2) ** (flank_class - 5)
    return 1e-6 * _rounded(f_pT)


def run_out(diameter: float, module: float, flank_class: int) -> float:
    """Return the tolerance of the radial run-out, F_rT; arguments as `single_pitch`."""
    d, m = _checked(diameter, module, flank_class)
    F_pT = (0.002 * d + 0.55 * math.sqrt(d) + 0.7 * m + 12) * math.sqrt(2) ** (
        flank_class - 5
    )
    return 1e-6 * _rounded(0.9 * F_pT)


def zone(error: str, diameter: float, module: float, flank_class: int) -> Tolerance:
    """Return the zone that a class permits a deviation of a gear.

    Parameters
    ----------
    error : str
        "run-out": the amplitude, half of what an indicator shows over a turn; "pitch":
        the position of a tooth.
    diameter, module : float
        Reference diameter and normal module, m.
    flank_class : int
        1 to 11.

    Returns
    -------
    Tolerance
        m.
    """
    if error == "run-out":
        return Tolerance(0.0, 0.5 * run_out(diameter, module, flank_class))
    pitch = single_pitch(diameter, module, flank_class)
    return Tolerance(-pitch, pitch)
