"""Units that stand in the cells beside their numbers: 12,34 mm, 0.5 %."""

import re
from contextlib import suppress
from functools import lru_cache

from tolstat.errors import UnitError
from tolstat.tables.grid import Cell, Quantity
from tolstat.tables.numerals import NUMERAL, Proof, proof
from tolstat.units.conversion import dimension

PLAIN = ("1", "count")
# a letter without a blank before it is rather a name, such as lot 1A
_QUANTITY = re.compile(
    rf"(?P<number>{NUMERAL})(?:(?<=\s)|(?!\w$))(?P<unit>[^\W\d_].*|[%°].*)"
)


@lru_cache(256)
def is_unit(text: str) -> bool:
    """Return whether a text is a unit; a count has none."""
    with suppress(UnitError):
        dimension(text)
        return text not in PLAIN
    return False


def split_cell(cell: Cell) -> tuple[Cell, str]:
    """Return a cell without its unit, and the unit; empty where it has none.

    Examples
    --------
    >>> split_cell("12,34 mm"), split_cell("0.5%"), split_cell("1A")
    (('12,34', 'mm'), ('0.5', '%'), ('1A', ''))
    """
    if isinstance(cell, Quantity):
        return cell
    if not isinstance(cell, str) or cell[-2:].isdigit():  # most cells
        return cell, ""
    match = _QUANTITY.fullmatch(cell)
    if match and proof(number := match["number"].strip()) is not Proof.NO_NUMBER:
        unit = match["unit"]
        return (number, unit) if is_unit(unit) else (cell, "")
    return cell, ""
