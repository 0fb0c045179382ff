"""Numbers as engineers write them: a unit that fits, figures that matter."""

from __future__ import annotations

import math

from tolstat.units.conversion import engineering_unit, from_si

FIGURES = 4


def number(value: float) -> str:
    """Write a number with four figures, three where it needs an exponent.

    Parameters
    ----------
    value : float
        In the unit to be shown.
    """
    if math.isnan(value):
        return "failed"
    if value == 0:
        return "0"
    if not 1e-3 <= abs(value) < 1e6:
        return f"{value:.{FIGURES - 2}e}"
    digits = max(0, FIGURES - 1 - math.floor(math.log10(abs(value))))
    return f"{value:.{digits}f}"


def in_engineering_unit(value: float, unit: str) -> str:
    """Write an SI number in the unit that tables show.

    Parameters
    ----------
    value : float
        SI.
    unit : str
        Its SI unit.
    """
    return number(from_si(value, unit, engineering_unit(unit)))


def limit_in_words(limit: tuple[float, float], unit: str) -> str:
    """Write a limit as a study file has it."""
    shown = engineering_unit(unit)
    lower, upper = (f"{from_si(end, unit, shown):.10g}" for end in limit)
    if math.isinf(limit[0]):
        return f"<= {upper} {shown}"
    if math.isinf(limit[1]):
        return f">= {lower} {shown}"
    return f"{lower}..{upper} {shown}"
