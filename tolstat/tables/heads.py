"""Where a table begins: its head, a row of units, and the lines above them."""

import re
from collections.abc import Collection, Sequence

from tolstat.tables.cell_units import is_unit, split_cell
from tolstat.tables.grid import Cell, Head, Row
from tolstat.tables.numerals import Proof, is_missing, proof

TAILS = 4, 2, 1  # parts of the rows; the last one shows which columns hold numbers
# "t [mm]", "t (mm)", "t in mm", "t / mm"
_BRACKETS = re.compile(r"(?P<name>.+?)\s*\[(?P<unit>[^\]]*)\]", re.DOTALL)
_WITH_UNIT = re.compile(
    r"(?P<name>.+?)(?:\s*\((?P<round>[^()]+)\)|(?:\s+in\s+|\s+/\s*)(?P<unit>\S+))",
    re.DOTALL,
)
# no units of a study: one that stands in brackets is refused, not part of a name
OTHER_UNITS = frozenset({
    "inch", "inches", "zoll", "mils", "micron", "microns", "feet", "ksi", "kgf", "kp",
    "lbs", "ozf", "grad", "degrees", "radians",
})  # fmt: skip
# what begins a row that is no part: of a summary or of the drawing, in some languages
SUMMARY = frozenset({
    "mean", "average", "avg", "mittelwert", "mittel", "moyenne", "media", "std",
    "stdev", "sd", "s.d.", "sigma", "streuung", "standardabweichung", "min", "min.",
    "minimum", "max", "max.", "maximum", "cp", "cpk", "pp", "ppk", "range",
    "spannweite", "median", "nominal", "nennmaß", "nennmass", "nennwert", "soll",
    "sollwert", "usl", "lsl", "ot", "ut", "osg", "usg",
})  # fmt: skip

# those that are no names of persons or lots, and tell a summary in any cell
ANYWHERE = frozenset({
    "mean", "average", "mittelwert", "moyenne", "stdev", "standardabweichung",
    "minimum", "maximum", "median", "sum", "summe", "total",
})  # fmt: skip
LAST = 8  # rows of a table that may be its summary


def is_number(cell: Cell) -> bool:
    """Return whether a cell can be read as a number."""
    if isinstance(cell, str):
        return proof(cell) is not Proof.NO_NUMBER
    return isinstance(cell, float)


def is_empty(cell: Cell) -> bool:
    """Return whether a cell says that there is no number."""
    return isinstance(cell, str) and is_missing(cell)


def has_number(cell: Cell) -> bool:
    """Return whether a cell can be read as a number, with or without a unit."""
    return is_number(cell) or is_number(split_cell(cell)[0])


def summary_word(row: Row) -> str:
    """Return the word that names a row of a summary; empty for any other row."""
    first = next((cell for cell in row.cells if not is_empty(cell)), "")
    known = isinstance(first, str) and first.strip(" :=").casefold() in SUMMARY
    return str(first) if known else ""


def summary_words_at_end(rows: Sequence[Row]) -> dict[int, str]:
    """Return the words of a summary in any cell of the last rows, by line.

    A column that has such words in other rows, too, is none of a summary.
    """

    def words(row: Row) -> list[str]:
        texts = [cell.strip(" :=") for cell in row.cells if isinstance(cell, str)]
        return [text for text in texts if text.casefold() in ANYWHERE]

    found = {row.line: text[0] for row in rows if (text := words(row))}
    last = {row.line for row in rows[-LAST:]}
    return found if found.keys() <= last and 2 * len(found) < len(rows) else {}


def head_of(rows: Sequence[Row], requested: Collection[str] = ()) -> Head | None:
    """Return the head of rows of equal width; None without one.

    Above each column of numbers a head has a text, and numbers come below it. Of
    several such rows it is the first, or the first one with a requested name.
    """
    for part in TAILS:
        tail = rows[-max(1, len(rows) // part) :]
        columns = _numeric(tail)
        heads = [
            head
            for index in range(len(rows) - 1)
            if columns and (head := _head_at(rows, index, columns))
        ]
        named = [head for head in heads if {*requested} & {*head.names}]
        if named:
            return named[0]
        if heads:
            return _with_rival(rows, heads[0], columns, requested)
    return None


def _with_rival(
    rows: Sequence[Row], head: Head, columns: Sequence[int], requested: Collection[str]
) -> Head:
    """Return a head with the row above it, if it may be a row of numbers itself.

    That is: numbers are in it, and only texts above. A requested name decides.
    """
    cells = [rows[head.position].cells[c] for c in columns]
    above = rows[max(0, head.position - 1)]
    texts = [above.cells[c] for c in columns]
    if not any(map(has_number, cells)) or any(map(has_number, texts)):
        return head
    if any(map(is_empty, texts)):
        return head
    names, units = zip(*map(split_head, above.cells), strict=True)
    if {*requested} & {*names}:
        return Head(head.position - 1, head.position, names, units)
    return head._replace(rival=above.line)


def split_head(cell: Cell) -> tuple[str, str]:
    """Return name and unit of a head.

    Examples
    --------
    >>> split_head("t_wall [mm]"), split_head("force (kN)"), split_head("d in mm")
    (('t_wall', 'mm'), ('force', 'kN'), ('d', 'mm'))
    >>> split_head("cavity (left)")
    ('cavity (left)', '')
    """
    text = f"{cell:.15g}" if isinstance(cell, float) else " ".join(str(cell).split())
    if match := _BRACKETS.fullmatch(text):
        return match["name"], match["unit"].strip()
    match = _WITH_UNIT.fullmatch(text)
    if match:
        unit = (match["round"] or match["unit"]).strip()
        if is_unit(unit) or (match["round"] and _means_unit(unit)):
            return match["name"], unit
    return text, ""


def _means_unit(word: str) -> bool:
    """Return whether a word in brackets means a unit that is written otherwise."""
    word = word.rstrip(".").casefold()
    return word in OTHER_UNITS or (len(word) > 1 and is_unit(word))


def _numeric(rows: Sequence[Row]) -> list[int]:
    """Return the columns in which numbers are as many as other words, or more."""
    columns = []
    for index, cells in enumerate(zip(*(row.cells for row in rows), strict=True)):
        filled = [cell for cell in cells if not is_empty(cell)]
        numbers = sum(map(has_number, filled))
        if numbers and 2 * numbers >= len(filled):
            columns.append(index)
    return columns


def _head_at(rows: Sequence[Row], index: int, columns: Sequence[int]) -> Head | None:
    """Return the head that a row is; None if it is none."""
    cells = rows[index].cells
    named = [c for c in columns if c or not is_empty(cells[c])]  # an index has no name
    above = [cells[c] for c in named]
    if any(map(is_empty, above)) or all(map(is_number, above)):
        return None
    body, units = index + 1, ("",) * len(cells)
    if words := _units(rows[body].cells, columns):
        body, units = body + 1, words
    below = (rows[i] for i in range(body, len(rows)))  # a slice would copy them
    if (first := next((row for row in below if not summary_word(row)), None)) is None:
        return None
    filled = [first.cells[c] for c in columns if not is_empty(first.cells[c])]
    if not filled or not all(map(has_number, filled)):
        return None
    if all(map(has_number, above)) and not all(map(is_number, filled)):
        return None  # numbers of parts, too: 12.3 mm above 12.4 mm
    parted = [split_head(cell) for cell in cells]
    return Head(
        index,
        body,
        tuple(name for name, _ in parted),
        tuple(own or row for (_, own), row in zip(parted, units, strict=True)),
    )


def _units(cells: Sequence[Cell], columns: Sequence[int]) -> tuple[str, ...]:
    """Return the units of a row that has nothing else; empty if it is none."""
    texts = [
        cell.strip().strip("[]()") if isinstance(cell, str) else "?" for cell in cells
    ]
    units = ["" if is_missing(text) else text for text in texts]
    real = [units[c] for c in columns if units[c]]
    if not real or not all(map(is_unit, real)):
        return ()
    return tuple(unit if is_unit(unit) else "" for unit in units)
