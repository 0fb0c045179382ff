"""Numbers as engineers write them: a unit that fits, figures that matter."""

from __future__ import annotations

import math

from tolstat.statistics.proportions import Proportion
from tolstat.statistics.quantiles import Quantile
from tolstat.units.conversion import engineering_unit, from_si

FIGURES = 4


def number(value: float) -> str:
    """Write a number with four figures; a dash for what is not known.

    Parameters
    ----------
    value : float
        In the unit to be shown.
    """
    if math.isnan(value):
        return "-"
    if value == 0:
        return "0"
    if not 1e-3 <= abs(value) < 1e6:
        return f"{value:.{FIGURES - 1}e}"
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


def quantile_with_interval(quantile: Quantile, unit: str) -> str:
    """Write a quantile over its interval, or how many trials that would need."""
    value = in_engineering_unit(quantile.estimate, unit)
    if math.isnan(quantile.lower) or math.isnan(quantile.upper):
        return f"not estimable\nneeds {quantile.needed}"
    lower = in_engineering_unit(quantile.lower, unit)
    upper = in_engineering_unit(quantile.upper, unit)
    return f"{value}\n{lower}..{upper}"


def share_with_interval(share: Proportion) -> str:
    """Write a share of trials in per cent over its interval."""
    lower, upper = number(100 * share.lower), number(100 * share.upper)
    return f"{number(100 * share.estimate)} %\n{lower}..{upper}"


def limit_in_words(limit: tuple[float, float], unit: str) -> str:
    """Write a limit as a study file has it."""
    shown = engineering_unit(unit)
    lower, upper = (f"{from_si(end, unit, shown):.10g}" for end in limit)
    if math.isinf(limit[0]):
        return f"<= {upper} {shown}"
    if math.isinf(limit[1]):
        return f">= {lower} {shown}"
    return f"{lower}..{upper} {shown}"
