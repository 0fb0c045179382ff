"""Tables whose columns are named arrays, as of Parquet."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.errors import DataError
from tolstat.tables.delimited import LONGEST_CELL
from tolstat.tables.grid import Cell, Grid, Head, Row, Unusable
from tolstat.tables.heads import split_head
from tolstat.tables.raw_file import RawFile

PARQUET = (".parquet", ".pq")
MOST_CELLS = 20_000_000
MOST_BYTES = 8 * MOST_CELLS
TEXT = "BYTE_ARRAY"  # as Parquet names it


class Column(NamedTuple):
    """A named array, and its unit; empty where it has none."""

    values: NDArray[Any]
    unit: str


def read_parquet(file: RawFile) -> Grid:
    """Return the rows of a Parquet file.

    Units stand in the head, `t [mm]`, or in the metadata of the field, as `unit`.
    """
    try:
        import pyarrow
        from pyarrow import parquet
    except ImportError as error:
        raise DataError(
            f"{file.path}: Parquet needs pyarrow, pip install 'tolstat[parquet]'; or "
            "save the table as CSV"
        ) from error
    try:
        facts = parquet.read_metadata(pyarrow.BufferReader(file.raw))
        groups = map(facts.row_group, range(facts.num_row_groups))
        check_room(
            8 * facts.num_rows * facts.num_columns,
            sum(group.total_byte_size for group in groups),
        )
        described = map(facts.schema.column, range(facts.num_columns))
        texts = [field.path for field in described if field.physical_type == TEXT]
        schema = parquet.read_schema(pyarrow.BufferReader(file.raw))
        # a row of lists may unpack to gigabytes; numbers of a time have no unit
        flat = [x.name for x in schema if not pyarrow.types.is_nested(x.type)]
        times = [x.name for x in schema if pyarrow.types.is_temporal(x.type)]
        # each different text is held once: a long one may stand in every row
        table = parquet.read_table(
            pyarrow.BufferReader(file.raw), columns=flat, read_dictionary=texts,
            use_threads=False, pre_buffer=False,  # threads may abort a short process
        )  # fmt: skip
        columns = {
            field.name: Column(
                table[field.name].to_pandas().astype(object).to_numpy(na_value="")
                if field.name in texts
                else np.asarray(table[field.name].to_pandas().astype(str), np.object_)
                if field.name in times
                else np.asarray(table[field.name].to_pandas()),
                (field.metadata or {}).get(b"unit", b"").decode(),
            )
            for field in table.schema
        }
    except (pyarrow.ArrowException, OSError, ValueError) as error:
        raise DataError(f"{file.path} cannot be read as Parquet: {error}") from None
    return grid_of(file, columns, "Parquet")


def check_room(*sizes: int) -> None:
    """Refuse what is larger, unpacked, than the cells that may be read."""
    if max(sizes) > MOST_BYTES:
        raise ValueError(
            f"it unpacks to {max(sizes) / 1e6:.0f} MB; at most "
            f"{MOST_BYTES / 1e6:.0f} MB are allowed"
        )


def grid_of(file: RawFile, columns: Mapping[str, Column], words: str) -> Grid:
    """Return named arrays of one length as rows, numbered from 1."""
    path = file.path
    rows = len(next(iter(columns.values())).values) if columns else 0
    if not rows:
        raise DataError(f"{path} has no rows")
    if rows * len(columns) > MOST_CELLS:
        raise DataError(
            f"{path} has {rows} rows of {len(columns)} columns; at most {MOST_CELLS} "
            "cells are read"
        )
    texts = (c.values for c in columns.values() if c.values.dtype.kind in "OSU")
    long = (x for t in texts for x in t if isinstance(x, str | bytes))
    if (longest := max(map(len, long), default=0)) > LONGEST_CELL:
        raise DataError(
            f"{path}: a cell has {longest} characters; at most {LONGEST_CELL} are "
            "allowed"
        )
    heads = [split_head(name) for name in columns]
    units = tuple(
        unit or column.unit
        for (_, unit), column in zip(heads, columns.values(), strict=True)
    )
    cells = zip(
        *([*map(_cell, c.values.tolist())] for c in columns.values()), strict=True
    )
    return Grid(
        path, file.digest,
        [Row(0, [*columns]), *(Row(i, [*row]) for i, row in enumerate(cells, 1))],
        Head(0, 1, tuple(name for name, _ in heads), units),
        words=(words,), counted="row",
    )  # fmt: skip


def _cell(value: Any) -> Cell:
    """Return a value of an array as a cell; NaN is an empty one."""
    if isinstance(value, bool) or value is None:
        return str(value).lower()
    if isinstance(value, int | float):
        number = float(value)
        if np.isnan(number):
            return ""
        return number if np.isfinite(number) else Unusable(str(value), "infinite")
    return _text(value)


def _text(value: Any) -> str:
    return value.decode(errors="replace") if isinstance(value, bytes) else str(value)
