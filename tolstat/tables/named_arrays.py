"""Tables whose columns are named arrays: Parquet, and HDF5 of other programs."""

import io
from collections.abc import Collection, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.errors import DataError, allowed_names
from tolstat.hdf5_heaps import longest_object
from tolstat.tables.delimited import LONGEST_CELL
from tolstat.tables.grid import Cell, Grid, Head, Row, Unusable
from tolstat.tables.heads import split_head
from tolstat.tables.raw_file import RawFile

PARQUET = (".parquet", ".pq")
HDF5 = (".h5", ".hdf5", ".hdf", ".he5")
UNIT_NAMES = "units", "unit"  # attributes of a dataset
MOST_CELLS = 20_000_000
MOST_BYTES = 8 * MOST_CELLS
KINDS = "biufSUO"  # of numbers and texts
DEEPEST = 8  # groups inside each other
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
        _check_room(
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
    return _grid(file, columns, "Parquet")


def read_hdf5(file: RawFile) -> Grid:
    """Return the rows of an HDF5 file: datasets of one length, or one of fields.

    Its sheet is the group, or the dataset of fields; by default the only one with
    columns. Those that are not requested may have another length.

    Raises
    ------
    DataError
        If it cannot be read, or there are several tables and none is named.
    """
    import h5py

    path, group, requested = file.path, file.form.sheet, file.requested
    try:
        longest = longest_object(file.raw)
        with h5py.File(io.BytesIO(file.raw)) as root:
            tables = dict[str, dict[str, Column]]()
            _add_tables(root, tables, requested, longest)
    except (OSError, RuntimeError, ValueError, TypeError, KeyError) as error:
        raise DataError(f"{path} cannot be read as HDF5: {error}") from None
    if not tables:
        raise DataError(
            f"{path} has no table: a group whose datasets have one dimension, each a "
            "column, or a dataset with fields is expected"
        )
    wanted = "/" + group.strip("/")
    if group and wanted not in tables:
        raise DataError(
            f"{path} has no table '{group}'; {allowed_names(wanted, tables)}"
        )
    having = [n for n, columns in tables.items() if {*requested} & {*_names(columns)}]
    chosen = [wanted] if group else having or [*tables]
    if len(chosen) > 1:
        raise DataError(
            f"{path} has several tables: {', '.join(chosen)}; give sheet = "
            f'"{chosen[0]}"'
        )
    return _grid(file, tables[chosen[0]], f"HDF5, {chosen[0]}")


def _add_tables(
    group: Any,
    tables: dict[str, dict[str, Column]],
    requested: Collection[str],
    longest: int,
    depth: int = 0,
    before: int = 0,
) -> int:
    """Add the tables of a group, and of the groups in it, by their paths.

    Links are not followed: they may lead into other files. Returns the bytes that were
    read, with those before; no text has more than the longest.
    """
    import h5py

    columns = dict[str, Column]()
    for name in group:
        if not isinstance(group.get(name, getlink=True), h5py.HardLink):
            continue
        item = group[name]
        if isinstance(item, h5py.Group):
            if depth < DEEPEST:
                before = _add_tables(
                    item, tables, requested, longest, depth + 1, before
                )
            continue
        if not isinstance(item, h5py.Dataset) or item.external or item.is_virtual:
            continue
        if item.ndim != 1 or not (item.dtype.names or item.dtype.kind in KINDS):
            continue
        before += item.nbytes
        _check_room(before)
        values, size = _read(item, longest)
        before += size
        if item.dtype.names:
            tables[item.name] = {n: Column(values[n], "") for n in item.dtype.names}
        else:
            units = (item.attrs[key] for key in UNIT_NAMES if key in item.attrs)
            columns[name] = Column(values, _text(next(units, "")))
    named = [c for n, c in columns.items() if split_head(n)[0] in requested]
    lengths = {len(column.values) for column in named or columns.values()}
    if len(lengths) > 1:
        raise ValueError(
            f"{group.name}: datasets have different lengths, "
            + ", ".join(f"{n} {len(c.values)}" for n, c in [*columns.items()][:8])
        )
    if lengths:
        (length,) = lengths
        tables[group.name] = {
            n: column for n, column in columns.items() if len(column.values) == length
        }
    return before


def _read(dataset: Any, longest: int) -> tuple[NDArray[Any], int]:
    """Return the values of a dataset, and how long its texts are, bytes.

    In parts: a few bytes refer to a text, which may be the longest each time.
    """
    parts, size = [dataset[:0]], 0
    rows = max(1, MOST_BYTES // max(longest, 1))
    for start in range(0, len(dataset), rows):
        parts.append(part := dataset[start : start + rows])
        fields = [part[n] for n in part.dtype.names] if part.dtype.names else [part]
        texts = (x for f in fields if f.dtype.kind == "O" for x in f.flat)
        size += sum(len(x) for x in texts if isinstance(x, bytes | np.ndarray))
        _check_room(size)
    return np.concatenate(parts), size


def _check_room(*sizes: int) -> None:
    """Refuse what is larger, unpacked, than the cells that may be read."""
    if max(sizes) > MOST_BYTES:
        raise ValueError(
            f"it unpacks to {max(sizes) / 1e6:.0f} MB; at most "
            f"{MOST_BYTES / 1e6:.0f} MB are allowed"
        )


def _names(columns: Mapping[str, Column]) -> list[str]:
    return [split_head(name)[0] for name in columns]


def _grid(file: RawFile, columns: Mapping[str, Column], words: str) -> Grid:
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
