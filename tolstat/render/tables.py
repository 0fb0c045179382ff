"""The one wide table of an answer: as CSV in the units shown, as a frame in SI."""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from tolstat.document.inline import Number
from tolstat.literal import csv_cell
from tolstat.statistics.estimate import Estimate
from tolstat.units.scale import Scale

if TYPE_CHECKING:
    import pandas as pd

FIGURES = 12  # what is left when units are converted
Row = Mapping[str, Number | str | int]  # by head: "mean [unit]", "failed"
ENDS = ("", " lower", " upper")


def rows_as_csv(rows: Sequence[Row]) -> str:
    """Write rows that have the same heads.

    Parameters
    ----------
    rows : sequence of mapping of str to Number, str or int
        A head may end in its unit in brackets; "[unit]" is that of the row. An
        estimate takes three columns: itself and the ends of its 95 % interval.

    Returns
    -------
    str
        CSV in the units shown; a cell is empty where there is no such number.
    """
    told = [dict(_cells(row)) for row in rows]
    return csv_text(told[0], [list(each.values()) for each in told])


def rows_as_frame(rows: Sequence[Row], index: str) -> pd.DataFrame:
    """Return the same in SI: `mean`, `mean_lower`, `mean_upper`, `quantile_95`, ..."""
    import pandas as pd

    found = []
    for row in rows:
        cells: dict[str, Any] = {}
        for head, given in row.items():
            name = re.sub(r"\W+", "_", _parted(head)[0]).strip("_")
            name = re.sub(r"(^|_)(?=\d)", r"\1quantile_", name, count=1)
            if head == "unit":  # the frame is in SI
                own = (n for h, n in row.items() if h.endswith("[unit]"))
                scales = [n.scale for n in own if isinstance(n, Number)]
                units = [each.unit for each in scales if isinstance(each, Scale)]
                given = next(iter(units), given)
            if isinstance(given, Number) and isinstance(given.value, Estimate):
                for end, each in zip(ENDS, given.value[:3], strict=True):
                    cells[name + end.replace(" ", "_")] = each
            else:
                cells[name] = given.value if isinstance(given, Number) else given
        found.append(cells)
    return pd.DataFrame(found).set_index(index)


def _cells(row: Row) -> Iterator[tuple[str, Any]]:
    for head, given in row.items():
        if not isinstance(given, Number):
            yield head, given
        elif isinstance(given.value, Estimate):
            name, unit = _parted(head)
            for end, value in zip(ENDS, given.value[:3], strict=True):
                yield name + end + unit, _figures(given.scale.factor * value)
        elif isinstance(given.value, int):
            yield head, given.value
        else:
            yield head, _figures(given.scale.factor * given.value)


def _parted(head: str) -> tuple[str, str]:
    name, bracket, unit = head.partition(" [")
    return name, bracket + unit


def _figures(value: float) -> float | str:
    """Return a number without the noise of its conversion; nothing for none."""
    if math.isnan(value):
        return ""
    return float(f"{value:.{FIGURES}g}")


def csv_text(heads: Iterable[str], rows: Iterable[Sequence[Any]]) -> str:
    """Write a table as CSV; no text in it is a formula to a spreadsheet.

    Parameters
    ----------
    heads : iterable of str
        Of the columns.
    rows : iterable of sequences
        Numbers and texts.
    """
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(map(csv_cell, heads))
    writer.writerows(map(csv_cell, row) for row in rows)
    return buffer.getvalue()
