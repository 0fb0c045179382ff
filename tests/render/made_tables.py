"""Tables made of columns and rows, to be shown."""

from tolstat.document.blocks import Cell, Column, Table
from tolstat.document.sentences import text


def table(columns, rows, title="", **others):
    """Make a table; a text is a column, and None an empty cell."""
    return Table(
        tuple(Column(each) if isinstance(each, str) else each for each in columns),
        tuple(tuple(map(cell, row)) for row in rows),
        title,
        **others,
    )


def cell(given):
    """Return a cell of what it is given as."""
    return given if isinstance(given, Cell) else Cell(text(given))
