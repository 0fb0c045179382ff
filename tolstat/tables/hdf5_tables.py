"""Tables in HDF5 files of other programs: named datasets, or one with fields."""

import io
import math
import zlib
from collections import deque
from collections.abc import Collection, Mapping
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from tolstat.errors import DataError, allowed_names
from tolstat.hdf5_heaps import check_sizes, longest_object
from tolstat.tables.grid import Grid
from tolstat.tables.heads import split_head
from tolstat.tables.named_arrays import MOST_BYTES, Column, check_room, grid_of
from tolstat.tables.raw_file import RawFile

UNIT_NAMES = "units", "unit"  # attributes of a dataset
NO_VALUES = "_FillValue", "missing_value"  # as netCDF names what is none
KINDS = "biufSU"  # of numbers and texts
DEEPEST = 8  # groups inside each other
MOST_ITEMS = 10_000  # groups and datasets
MOST_CHUNKS = 500_000
DEFLATE, FLETCHER32 = h5py.h5z.FILTER_DEFLATE, h5py.h5z.FILTER_FLETCHER32
FILTERS = {DEFLATE, FLETCHER32, h5py.h5z.FILTER_SHUFFLE, h5py.h5z.FILTER_LZF}
CHECKSUM = 4  # bytes that FLETCHER32 adds to a chunk
# h5py.Dataset by path of a table and name of the column; "" for one of fields
Tables = dict[str, dict[str, Any]]


def read_hdf5(file: RawFile) -> Grid:
    """Return the rows of an HDF5 file: datasets of one length, or one of fields.

    Its sheet is the group, or the dataset of fields; by default the only one with
    columns. Those that are not requested may have another length.

    Raises
    ------
    DataError
        If it cannot be read, or there are several tables and none is named.
    """
    try:
        longest = longest_object(file.raw)
        with h5py.File(io.BytesIO(file.raw)) as root:
            check_sizes(root)
            name, datasets = _chosen(file, _tables_in(root))
            columns = _columns(name, datasets, file.requested, longest)
    except DataError:
        raise
    except (OSError, RuntimeError, ValueError, TypeError, KeyError) as error:
        raise DataError(f"{file.path} cannot be read as HDF5: {error}") from None
    return grid_of(file, columns, f"HDF5, {name}")


def _tables_in(root: Any) -> Tables:
    """Return where columns lie in all groups.

    Links are not followed: they may lead into other files.
    """
    tables, groups, items = Tables(), deque([(root, 0)]), 0
    while groups:
        group, depth = groups.popleft()
        columns = dict[str, Any]()
        for name in group:
            items += 1
            if items > MOST_ITEMS:
                raise ValueError(f"more than {MOST_ITEMS} groups and datasets")
            if not isinstance(group.get(name, getlink=True), h5py.HardLink):
                continue
            item = group[name]
            if isinstance(item, h5py.Group) and depth < DEEPEST:
                groups.append((item, depth + 1))
            if not isinstance(item, h5py.Dataset) or item.external or item.is_virtual:
                continue
            if item.ndim != 1:
                continue
            if item.dtype.names and all(map(_is_readable, _fields(item).values())):
                tables[item.name] = {"": item}
            elif _is_plain(item.dtype):
                columns[name] = item
        if columns:
            tables[group.name] = columns
    return tables


def _is_plain(dtype: np.dtype[Any]) -> bool:
    return dtype.kind in KINDS or h5py.check_string_dtype(dtype) is not None


def _is_readable(dtype: np.dtype[Any]) -> bool:
    """Return whether the library reads no more texts for a field than are counted."""
    return _is_plain(dtype) or not dtype.hasobject


def _fields(dataset: Any) -> dict[str, np.dtype[Any]]:
    return {name: dataset.dtype[name] for name in dataset.dtype.names}


def _chosen(file: RawFile, tables: Tables) -> tuple[str, dict[str, Any]]:
    """Return the path of the table that is meant, and its columns."""
    path, group = file.path, file.form.sheet
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
    having = [n for n, found in tables.items() if _requested(found, file.requested)]
    chosen = [wanted] if group else having or [*tables]
    if len(chosen) > 1:
        raise DataError(
            f"{path} has several tables: {', '.join(chosen)}; give sheet = "
            f'"{chosen[0]}"'
        )
    return chosen[0], tables[chosen[0]]


def _requested(datasets: Mapping[str, Any], names: Collection[str]) -> list[str]:
    """Return the datasets that have a requested column."""
    return [
        name for name, dataset in datasets.items()
        if any(split_head(n)[0] in names for n in dataset.dtype.names or [name])
    ]  # fmt: skip


def _columns(
    table: str, datasets: Mapping[str, Any], requested: Collection[str], longest: int
) -> dict[str, Column]:
    """Return the columns of a table: those as long as the requested ones, or all."""
    named = _requested(datasets, requested) or [*datasets]
    lengths = {len(datasets[name]) for name in named}
    if len(lengths) > 1:
        raise ValueError(
            f"{table}: datasets have different lengths, "
            + ", ".join(f"{name} {len(x)}" for name, x in [*datasets.items()][:8])
        )
    used = {name: x for name, x in datasets.items() if len(x) in lengths}
    check_room(sum(dataset.nbytes for dataset in used.values()))
    columns, total = dict[str, Column](), 0
    for name, dataset in used.items():
        _check_chunks(dataset)
        values, size = _rows(dataset, longest)
        total += size
        check_room(total)
        if dataset.dtype.names:
            plain = [n for n, kind in _fields(dataset).items() if _is_plain(kind)]
            columns |= {n: Column(values[n], "") for n in plain}
        else:
            columns[name] = Column(_unpacked(dataset, values), _unit_of(dataset))
    return columns


def _rows(dataset: Any, longest: int) -> tuple[NDArray[Any], int]:
    """Return the values of a dataset, and how long its texts are, bytes.

    In parts: a few bytes refer to a text, which may be the longest each time.
    """
    names = dataset.dtype.names or ()
    texts = [name for name in names if dataset.dtype[name].kind == "O"]
    if not texts and dataset.dtype.kind != "O":
        return dataset[:], 0
    size, parts = 0, [dataset[:0]]
    step = max(1, MOST_BYTES // (max(longest, 1) * max(len(texts), 1)))
    for start in range(0, len(dataset), step):
        part = dataset[start : start + step]
        parts.append(part)
        fields = [part[name] for name in texts] or [part]
        size += sum(len(text) for field in fields for text in field)
        check_room(size)
    return np.concatenate(parts), size


def _unpacked(dataset: Any, values: NDArray[Any]) -> NDArray[Any]:
    """Return numbers that netCDF packed: scaled, and a value that stands for none."""
    if values.dtype.kind not in "iuf":
        return values
    none = [_number(dataset, key) for key in NO_VALUES]
    scale = _number(dataset, "scale_factor")
    offset = _number(dataset, "add_offset")
    for number in none:
        if number is not None and (values == number).any():
            values = np.where(values == number, np.nan, values)
    if scale is not None:
        values = values * scale
    return values if offset is None else values + offset


def _number(dataset: Any, key: str) -> float | None:
    """Return an attribute that is one number; None if there is none."""
    if key not in dataset.attrs:
        return None
    values = _attribute(dataset, key)
    if values is None or values.dtype.kind not in "iuf":
        raise ValueError(f"{dataset.name}: its {key} is not one number")
    return float(values.item())


def _unit_of(dataset: Any) -> str:
    for key in UNIT_NAMES:
        if key in dataset.attrs:
            values = _attribute(dataset, key)
            text = None if values is None else values.item()
            if not isinstance(text, str | bytes):
                raise ValueError(f"{dataset.name}: its {key} is not one text")
            return text.decode(errors="replace") if isinstance(text, bytes) else text
    return ""


def _attribute(dataset: Any, key: str) -> NDArray[Any] | None:
    """Return an attribute of one value; None if it has several, which may be long."""
    stored = dataset.attrs.get_id(key)
    if math.prod(stored.shape or (1,)) != 1 or not _is_plain(stored.dtype):
        return None
    return np.asarray(dataset.attrs[key])


def _check_chunks(dataset: Any) -> None:
    """Refuse chunks that unpack to more than they hold; ValueError.

    HDF5 unpacks whatever they hold, and ends the process at one that is too short.
    """
    if not dataset.chunks:
        return
    held = math.prod(dataset.chunks) * dataset.dtype.itemsize
    check_room(held)
    if len(dataset) > MOST_CHUNKS * dataset.chunks[0]:
        raise ValueError(f"{dataset.name} has more than {MOST_CHUNKS} chunks")
    plan = dataset.id.get_create_plist()
    filters = [plan.get_filter(i)[0] for i in range(plan.get_nfilters())]
    if not {*filters} <= FILTERS or len({*filters}) < len(filters):
        raise ValueError(f"{dataset.name} is packed in an unknown way")
    if not filters:
        return
    chunks = list[Any]()
    dataset.id.chunk_iter(chunks.append)
    for chunk in chunks:
        if chunk.size < CHECKSUM and FLETCHER32 in filters:
            raise ValueError(f"{dataset.name} has a chunk that is cut off")
        if DEFLATE not in filters or chunk.filter_mask:
            continue
        packed = dataset.id.read_direct_chunk(chunk.chunk_offset)[1]
        packed = packed[:-CHECKSUM] if filters[-1] == FLETCHER32 else packed
        whole = zlib.decompressobj().decompress(packed, held + CHECKSUM + 1)
        if len(whole) > held + CHECKSUM:
            raise ValueError(f"{dataset.name} has a chunk that unpacks to more")
