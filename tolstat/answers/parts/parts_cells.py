"""Cells of measured parts in wide tables: a row of their own, or among others."""

import math

from tolstat.answers.parts.judged_parts import JudgedParts
from tolstat.document.inline import Number, Row
from tolstat.units.scale import PER_CENT, PLAIN


def parts_cells(part: JudgedParts) -> Row:
    """Return the numbers of measured parts by their heads."""
    numbers, scale = part.capability, part.scale
    lower, upper = (end if math.isfinite(end) else math.nan for end in part.tolerance)
    return {
        "unit": scale.shown,
        "parts": numbers.parts,
        "nominal [unit]": Number(part.nominal, scale),
        "lower limit [unit]": Number(lower, scale),
        "upper limit [unit]": Number(upper, scale),
        "mean [unit]": Number(numbers.mean, scale),
        "sigma [unit]": Number(numbers.sigma, scale),
        "Pp": Number(numbers.pp),
        "Ppk": Number(numbers.ppk),
        "Cp": Number(numbers.cp),
        "Cpk": Number(numbers.cpk),
        "below": numbers.below,
        "above": numbers.above,
        "outside [%]": Number(numbers.outside, PER_CENT),
        "warnings": ", ".join(warning.kind for warning in part.warnings),
    }


def named_cells(name: str, part: JudgedParts) -> Row:
    """Return the same among other cells: each head has the name and the unit."""
    cells = {head: cell for head, cell in parts_cells(part).items() if head != "unit"}
    unit = "" if part.scale.shown in ("", PLAIN) else f" [{part.scale.shown}]"
    return {f"{name} {head.replace(' [unit]', unit)}": c for head, c in cells.items()}
