"""Tolerances by the tables of standards: grades of sizes, classes of gears.

ISO 286-1 is here as the table of the standard, whose values are rounded: its formula
gives other values for many of them (180 to 250 mm, IT9: table 115 um, formula 116 um).
ISO 1328-1 is here in the edition of 2013; that of 1995 rounded the diameter and the
module to ranges first: its classes give other values.

References
----------
ISO 286-1:2010, Table 1.
ISO 1328-1:2013, 5.2 (rounding), 5.3.2 (single pitch), annex E (run-out, informative:
nine tenths of the total cumulative pitch deviation).
"""

from bisect import bisect_left
from decimal import ROUND_HALF_UP, Context, Decimal

from tolstat.deviations.distributions import Tolerance
from tolstat.errors import GradeError

GRADES = range(-1, 19)  # IT01 is -1

# upper ends of ranges of sizes up to 500 mm; IT01 and IT0 there, um
COARSE = (3, 6, 10, 18, 30, 50, 80, 120, 180, 250, 315, 400, 500)
FINEST = {
    -1: (0.3, 0.4, 0.4, 0.5, 0.6, 0.6, 0.8, 1, 1.2, 2, 2.5, 3, 4),
    0: (0.5, 0.6, 0.6, 0.8, 1, 1, 1.2, 1.5, 2, 3, 4, 5, 6),
}
# upper end of a range of sizes, mm (above that of the row before): IT1 to IT18, um
_ROWS = """
3 0.8 1.2 2 3 4 6 10 14 25 40 60 100 140 250 400 600 1000 1400
6 1 1.5 2.5 4 5 8 12 18 30 48 75 120 180 300 480 750 1200 1800
10 1 1.5 2.5 4 6 9 15 22 36 58 90 150 220 360 580 900 1500 2200
18 1.2 2 3 5 8 11 18 27 43 70 110 180 270 430 700 1100 1800 2700
30 1.5 2.5 4 6 9 13 21 33 52 84 130 210 330 520 840 1300 2100 3300
50 1.5 2.5 4 7 11 16 25 39 62 100 160 250 390 620 1000 1600 2500 3900
80 2 3 5 8 13 19 30 46 74 120 190 300 460 740 1200 1900 3000 4600
120 2.5 4 6 10 15 22 35 54 87 140 220 350 540 870 1400 2200 3500 5400
180 3.5 5 8 12 18 25 40 63 100 160 250 400 630 1000 1600 2500 4000 6300
250 4.5 7 10 14 20 29 46 72 115 185 290 460 720 1150 1850 2900 4600 7200
315 6 8 12 16 23 32 52 81 130 210 320 520 810 1300 2100 3200 5200 8100
400 7 9 13 18 25 36 57 89 140 230 360 570 890 1400 2300 3600 5700 8900
500 8 10 15 20 27 40 63 97 155 250 400 630 970 1550 2500 4000 6300 9700
630 9 11 16 22 32 44 70 110 175 280 440 700 1100 1750 2800 4400 7000 11000
800 10 13 18 25 36 50 80 125 200 320 500 800 1250 2000 3200 5000 8000 12500
1000 11 15 21 28 40 56 90 140 230 360 560 900 1400 2300 3600 5600 9000 14000
1250 13 18 24 33 47 66 105 165 260 420 660 1050 1650 2600 4200 6600 10500 16500
1600 15 21 29 39 55 78 125 195 310 500 780 1250 1950 3100 5000 7800 12500 19500
2000 18 25 35 46 65 92 150 230 370 600 920 1500 2300 3700 6000 9200 15000 23000
2500 22 30 41 55 78 110 175 280 440 700 1100 1750 2800 4400 7000 11000 17500 28000
3150 26 36 50 68 96 135 210 330 540 860 1350 2100 3300 5400 8600 13500 21000 33000
"""
TABLE = {
    int(size): tuple(map(float, widths))
    for size, *widths in map(str.split, _ROWS.strip().splitlines())
}


def width(grade: int, size: float) -> float:
    """Return the width of a tolerance grade at a nominal size, m; IT01 is -1.

    Raises `GradeError` if the table of the standard lacks this grade or size.
    """
    if grade not in GRADES:
        raise GradeError("grades of ISO 286-1 are IT01, IT0 and IT1 to IT18")
    millimetres = round(1e3 * size, 9)
    if not 0 < millimetres <= 3150:
        raise GradeError(
            f"IT{grade} of {millimetres:g} mm: the table of ISO 286-1 ends at 3150 mm; "
            "give the tolerance in mm"
        )
    if grade >= 14 and millimetres <= 1:
        raise GradeError(
            f"IT{grade} of {millimetres:g} mm: ISO 286-1 has IT14 and above only over "
            "1 mm"
        )
    if grade < 1:
        if millimetres > COARSE[-1]:
            raise GradeError("ISO 286-1 has IT01 and IT0 up to 500 mm")
        return 1e-6 * FINEST[grade][bisect_left(COARSE, millimetres)]
    ends = list(TABLE)
    return 1e-6 * TABLE[ends[bisect_left(ends, millimetres)]][grade - 1]


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
