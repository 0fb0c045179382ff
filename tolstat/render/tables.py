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
    """Write rows that have the same heads as CSV, in the units shown.

    A head may end in its unit in brackets; "[unit]" is that of the row. An estimate
    takes three columns: itself and the ends of its 95 % interval.
    """
    told = [
        {head: _shown(value, factor) for head, value, factor in _cells(row)}
        for row in rows
    ]
    return csv_text(told[0], [list(each.values()) for each in told])


def rows_as_frame(rows: Sequence[Row], index: str) -> pd.DataFrame:
    """Return the same in SI: `mean`, `mean_lower`, `mean_upper`, `quantile_95`, ..."""
    import pandas as pd

    found = []
    for row in rows:
        cells: dict[str, Any] = {}
        for head, value, _ in _cells(row):
            name = re.sub(r"\W+", "_", head.partition(" [")[0]).strip("_")
            cells[re.sub(r"(^|_)(?=\d)", r"\1quantile_", name, count=1)] = value
        if "unit" in cells:  # the frame is in SI
            own = (n for head, n in row.items() if head.endswith("[unit]"))
            scales = [n.scale for n in own if isinstance(n, Number)]
            units = [each.unit for each in scales if isinstance(each, Scale)]
            cells["unit"] = next(iter(units), cells["unit"])
        found.append(cells)
    return pd.DataFrame(found).set_index(index)


def _cells(row: Row) -> Iterator[tuple[str, Any, float]]:
    """Yield heads, values in SI, and what they are multiplied by to be shown."""
    for head, given in row.items():
        if not isinstance(given, Number):
            yield head, given, 0.0
        elif isinstance(given.value, Estimate):
            name, bracket, unit = head.partition(" [")
            for end, value in zip(ENDS, given.value[:3], strict=True):
                yield name + end + bracket + unit, value, given.scale.factor
        else:
            yield head, given.value, given.scale.factor


def _shown(value: Any, factor: float) -> Any:
    """Return a number without the noise of its conversion; nothing for none."""
    if isinstance(value, str | int):
        return value
    return "" if math.isnan(value) else float(f"{factor * value:.{FIGURES}g}")


def csv_text(heads: Iterable[str], rows: Iterable[Sequence[Any]]) -> str:
    """Write a table as CSV; no text in it is a formula to a spreadsheet."""
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(map(csv_cell, heads))
    writer.writerows(map(csv_cell, row) for row in rows)
    return buffer.getvalue()
