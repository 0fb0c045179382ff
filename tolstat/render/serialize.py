"""An answer as data: JSON and a frame in SI, CSV in the units shown."""

from __future__ import annotations

import csv
import io
import json
import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import fields, is_dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from tolstat.document.inline import Number, Row, Typed
from tolstat.literal import csv_cell
from tolstat.statistics.estimate import Estimate
from tolstat.units.scale import Scale, share_words

if TYPE_CHECKING:
    import pandas as pd

SCHEMA = 3  # raised when a name or a meaning changes
FIGURES = 12  # significant after a conversion of units
ENDS, REASON = ("", " lower", " upper"), " reason"


def as_json(answer: Any, name: str) -> str:
    """Return a typed answer as JSON, SI.

    Parameters
    ----------
    answer : dataclass
        Its fields are the names of the schema.
    name : str
        Which answer it is.

    Returns
    -------
    str
        An estimate is value, lower, upper (its 95 % interval) and reason. Unknown
        numbers are null, infinite ones "inf" or "-inf".
    """
    content = {"schema": SCHEMA, "answer": name, **_plain(answer)}
    lines = io.StringIO()  # a list of all pieces takes ten times the memory
    json.dump(content, lines, indent=1, allow_nan=False)
    return lines.getvalue() + "\n"


def _plain(value: Any) -> Any:
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float):  # most values are numbers
        if math.isfinite(value):
            return value
        return None if math.isnan(value) else "inf" if value > 0 else "-inf"
    if isinstance(value, Path | Typed):
        return str(value)
    if isinstance(value, Scale):
        return {"unit": value.unit, "shown": value.shown}
    if is_dataclass(value) and not isinstance(value, type):
        return {
            name: _plain(getattr(value, name)) for name in public_fields(type(value))
        }
    if hasattr(value, "_asdict"):
        return {name: _plain(item) for name, item in value._asdict().items()}
    if isinstance(value, Mapping):
        return {_key(key): _plain(item) for key, item in value.items()}
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [_plain(item) for item in value]
    return value


def _key(key: object) -> str:
    """Return a key: a quantile by its share, several contributors by their names."""
    if isinstance(key, float):
        return share_words(key)
    return ", ".join(key) if isinstance(key, tuple) else str(key)


@cache
def public_fields(record: Any) -> list[str]:
    """Return the fields of a dataclass that are part of its schema."""
    return [field.name for field in fields(record) if field.metadata.get("json", True)]


def rows_as_csv(rows: Sequence[Row]) -> str:
    """Return rows with the same heads as CSV, in the units shown.

    A head may end in its unit in brackets; "[unit]" is that of the row. An estimate
    takes four columns: itself, the ends of its 95 % interval, and why it has none.
    """
    return csv_text(*table_of_rows(rows))


def table_of_rows(rows: Sequence[Row]) -> tuple[list[str], Iterator[list[Any]]]:
    """Return the heads of a wide table, and its cells in the units shown."""
    heads = [head for head, _, _ in _cells(rows[0])]
    cells = ([_converted(value, times) for _, value, times in _cells(r)] for r in rows)
    return heads, cells


def rows_as_frame(rows: Sequence[Row], index: str) -> pd.DataFrame:
    """Return the same in SI: `mean`, `mean_lower`, `mean_upper`, `quantile_95`, ...

    Reasons are left out, so that the columns of an estimate are numbers.
    """
    import pandas as pd

    return pd.DataFrame(map(_in_si, rows)).set_index(index)


def _in_si(row: Row) -> dict[str, Any]:
    """Return the numbers of a row by their names in a frame."""
    cells: dict[str, Any] = {}
    for head, value, _ in _cells(row):
        if not head.endswith(REASON):
            name = re.sub(r"\W+", "_", head.partition(" [")[0]).strip("_")
            cells[re.sub(r"(^|_)(?=\d)", r"\1quantile_", name, count=1)] = value
    if "unit" in cells:
        scales = (
            cell.scale
            for head, cell in row.items()
            if head.endswith("[unit]") and isinstance(cell, Number)
        )
        units = (scale.unit for scale in scales if isinstance(scale, Scale))
        cells["unit"] = next(units, cells["unit"])
    return cells


def _cells(row: Row) -> Iterator[tuple[str, Any, float]]:
    """Yield heads, values in SI, and the factors to the units shown."""
    for head, content in row.items():
        if not isinstance(content, Number):
            yield head, content, 0.0
        elif isinstance(content.value, Estimate):
            name, bracket, unit = head.partition(" [")
            for end, value in zip(ENDS, content.value[:3], strict=True):
                yield name + end + bracket + unit, value, content.scale.factor
            yield name + REASON, content.value.reason, 0.0
        else:
            yield head, content.value, content.scale.factor


def _converted(value: Any, factor: float) -> Any:
    """Return a number without rounding errors of its conversion; empty for none."""
    if isinstance(value, str | int):
        return value
    return "" if math.isnan(value) else float(f"{factor * value:.{FIGURES}g}")


def csv_text(heads: Iterable[str], rows: Iterable[Sequence[Any]]) -> str:
    """Return a table as CSV; no text in it is a formula to a spreadsheet."""
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(map(csv_cell, heads))
    writer.writerows(map(csv_cell, row) for row in rows)
    return buffer.getvalue()
