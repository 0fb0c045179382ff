"""An answer as data: JSON and a frame in SI, CSV in the units shown."""

from __future__ import annotations

import csv
import io
import json
import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from tolstat.document.inline import Number
from tolstat.literal import csv_cell
from tolstat.statistics.estimate import Estimate
from tolstat.units.scale import Scale, share_words

if TYPE_CHECKING:
    import pandas as pd

SCHEMA = 3  # raised when a name or a meaning changes
FIGURES = 12  # significant after a conversion of units
Row = Mapping[str, Number | str | int]  # by head: "mean [unit]", "failed"
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
    found = {"schema": SCHEMA, "answer": name, **_plain(answer)}
    return json.dumps(found, indent=1, allow_nan=False) + "\n"


def _plain(found: Any) -> Any:
    if isinstance(found, Scale):
        return {"unit": found.unit, "shown": found.shown}
    if is_dataclass(found) and not isinstance(found, type):
        return {
            name: _plain(getattr(found, name)) for name in public_fields(type(found))
        }
    if hasattr(found, "_asdict"):
        return {name: _plain(value) for name, value in found._asdict().items()}
    if isinstance(found, Mapping):
        return {_key(key): _plain(value) for key, value in found.items()}
    if isinstance(found, Sequence) and not isinstance(found, str):
        return [_plain(value) for value in found]
    if isinstance(found, np.generic):
        found = found.item()
    if isinstance(found, float) and not math.isfinite(found):
        return None if math.isnan(found) else "inf" if found > 0 else "-inf"
    return str(found) if isinstance(found, Path) else found


def _key(key: object) -> str:
    """Return a key: a quantile by its share, several contributors by their names."""
    if isinstance(key, float):
        return share_words(key)
    return ", ".join(key) if isinstance(key, tuple) else str(key)


def public_fields(record: Any) -> list[str]:
    """Return the fields of a dataclass that are part of its schema."""
    return [each.name for each in fields(record) if each.metadata.get("json", True)]


def rows_as_csv(rows: Sequence[Row]) -> str:
    """Return rows with the same heads as CSV, in the units shown.

    A head may end in its unit in brackets; "[unit]" is that of the row. An estimate
    takes four columns: itself, the ends of its 95 % interval, and why it has none.
    """
    shown = [
        {head: _shown(value, factor) for head, value, factor in _cells(row)}
        for row in rows
    ]
    return csv_text(shown[0], [list(each.values()) for each in shown])


def rows_as_frame(rows: Sequence[Row], index: str) -> pd.DataFrame:
    """Return the same in SI: `mean`, `mean_lower`, `mean_upper`, `quantile_95`, ...

    Reasons are left out, so that the columns of an estimate are numbers.
    """
    import pandas as pd

    found = []
    for row in rows:
        cells: dict[str, Any] = {}
        numbers = (each for each in _cells(row) if not each[0].endswith(REASON))
        for head, value, _ in numbers:
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
    """Yield heads, values in SI, and the factors to the units shown."""
    for head, given in row.items():
        if not isinstance(given, Number):
            yield head, given, 0.0
        elif isinstance(given.value, Estimate):
            name, bracket, unit = head.partition(" [")
            for end, value in zip(ENDS, given.value[:3], strict=True):
                yield name + end + bracket + unit, value, given.scale.factor
            yield name + REASON, given.value.reason, 0.0
        else:
            yield head, given.value, given.scale.factor


def _shown(value: Any, factor: float) -> Any:
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
