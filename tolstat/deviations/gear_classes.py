"""ISO 1328-1: tolerances of gears by flank class, in the edition of 2013.

That of 1995 rounded the diameter and the module to ranges first: its classes give other
values.

References
----------
ISO 1328-1:2013, 5.2 (rounding), 5.3.2 (single pitch), annex E (run-out, informative:
nine tenths of the total cumulative pitch deviation).
"""

from decimal import ROUND_HALF_UP, Context, Decimal

from tolstat.deviations.distributions import Tolerance
from tolstat.errors import GradeError

ISO_1328 = "ISO 1328-1:2013"
GEAR_CLASSES = range(1, 12)
# many values are exact ties, such as 4.75 um, which binary fractions do not hold
_DECIMAL = Context(prec=40, rounding=ROUND_HALF_UP)


def _rounded(micrometres: Decimal) -> float:
    """Return m, rounded by 5.2 to 1 um above 10 um, 0.5 um above 5 um, else 0.1 um.

    Ties are rounded up.
    """
    step = Decimal("1" if micrometres > 10 else "0.5" if micrometres > 5 else "0.1")
    steps = _DECIMAL.divide(micrometres, step).to_integral_value(ROUND_HALF_UP)
    return float(steps * step * Decimal("1e-6"))


def _millimetres(metres: float) -> Decimal:
    """Return a length as on a drawing: 12 figures."""
    return (1000 * Decimal(f"{metres:.12g}")).normalize()


def _checked(
    diameter: float, module: float, flank_class: int
) -> tuple[Decimal, Decimal]:
    """Return diameter and module, mm, if the standard covers them."""
    d, m = _millimetres(diameter), _millimetres(module)
    if flank_class not in GEAR_CLASSES:
        raise GradeError(f"class {flank_class}: {ISO_1328} has the classes 1 to 11")
    if not Decimal("0.5") <= m <= 70:
        raise GradeError(f"module {m:f} mm: {ISO_1328} covers 0.5 to 70 mm")
    if not 5 <= d / m <= 1000:
        raise GradeError(
            f"module {m:f} mm: a wheel of {d:f} mm would have {d / m:.1f} teeth; "
            f"{ISO_1328} covers 5 to 1000"
        )
    if not 5 <= d <= 15000:
        raise GradeError(f"diameter {d:f} mm: {ISO_1328} covers 5 to 15000 mm")
    return d, m


def _of_class(micrometres: Decimal, flank_class: int) -> Decimal:
    """Return the value of a class from that of class 5: root 2 for each class."""
    twice, once = divmod(flank_class - 5, 2)
    value = _DECIMAL.multiply(micrometres, _DECIMAL.power(Decimal(2), twice))
    return _DECIMAL.multiply(value, _DECIMAL.sqrt(Decimal(2))) if once else value


def single_pitch(diameter: float, module: float, flank_class: int) -> float:
    """Return the tolerance of the single pitch deviation, f_pT, m, to either side.

    Arguments and errors as of `gear_zone`.
    """
    d, m = _checked(diameter, module, flank_class)
    f_pT = Decimal("0.001") * d + Decimal("0.4") * m + 5
    return _rounded(_of_class(f_pT, flank_class))


def run_out(diameter: float, module: float, flank_class: int) -> float:
    """Return the tolerance of the radial run-out, F_rT, m; see `gear_zone`."""
    d, m = _checked(diameter, module, flank_class)
    root = _DECIMAL.sqrt(d)
    F_pT = Decimal("0.002") * d + Decimal("0.55") * root + Decimal("0.7") * m + 12
    return _rounded(_of_class(Decimal("0.9") * F_pT, flank_class))


def gear_zone(
    error: str, diameter: float, module: float, flank_class: int
) -> Tolerance:
    """Return the zone of a deviation of a gear in a class, m.

    Raises `GradeError` if the standard does not cover the arguments.

    Parameters
    ----------
    error : str
        "run-out": the amplitude, half of what an indicator shows over a turn; "pitch":
        the position of a tooth.
    diameter, module : float
        Reference diameter and normal module, m.
    flank_class : int
        1 to 11.
    """
    if error == "run-out":
        return Tolerance(0.0, 0.5 * run_out(diameter, module, flank_class))
    pitch = single_pitch(diameter, module, flank_class)
    return Tolerance(-pitch, pitch)
