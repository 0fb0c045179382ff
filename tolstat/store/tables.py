"""Mappings of mappings in HDF5: arrays over their keys, so that their number is small.

The keys are text datasets, and dimension scales of the arrays. Records become one array
for each field, with the names of the fields of records in them joined. Tuples of equal
length become one more dimension. Where a key is
missing in some of the mappings, `present` says which have it.
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple, get_args, get_origin

import h5py
import numpy as np

from tolstat.store.stored_fields import BETWEEN, TEXT, fields_of

VALUE, PRESENT, PLACE = "value", "present", "place"  # names of arrays
EMPTY = {float: np.nan, int: 0, bool: False, str: ""}  # of a key that is missing


def place_name(group: str) -> str:
    """Return the name of the dimension of lists in a group: as no column is called."""
    return f"{group.strip('/').replace('/', '_')}_{PLACE}"


def is_place(name: str, group: str) -> bool:
    """Return whether a name in a group is that of such a dimension."""
    return bool(re.fullmatch(re.escape(place_name(group)) + r"(_\d+)?", name))


class Cells(NamedTuple):
    """Values at some places of arrays over the axes so far."""

    places: Sequence[tuple[int, ...]]
    values: Sequence[Any]
    shape: tuple[int, ...]


def write_table(
    group: h5py.Group, values: Mapping[Any, Any], kind: Any, axes: Sequence[str]
) -> None:
    """Write a mapping of mappings, of which `axes` names the keys."""
    _write(group, Cells([()], [values], ()), kind, axes, "")


def _write(
    group: h5py.Group, cells: Cells, kind: Any, axes: Sequence[str], name: str
) -> None:
    if is_mapping(kind):
        axis, (_, inner) = axes[len(cells.shape)], get_args(kind)
        places = {key: i for i, key in enumerate(_keys(cells.values))}
        group[axis] = np.array([_text(key) for key in places], TEXT)
        group[axis].make_scale(axis)
        entries = [  # place and value
            ((*place, places[key]), value)
            for place, values in zip(cells.places, cells.values, strict=True)
            for key, value in values.items()
        ]
        shape = (*cells.shape, len(places))
        inside = Cells([e[0] for e in entries], [e[1] for e in entries], shape)
        if len(entries) < np.prod(shape):
            presence = Cells(inside.places, [True] * len(entries), shape)
            _write(group, presence, bool, axes, f"{PRESENT}_{axis}")
        _write(group, inside, inner, axes, name)
    elif fields := _fields(kind):
        for field in fields:
            values = [getattr(record, field.name) for record in cells.values]
            inside = cells._replace(values=values)
            _write(group, inside, field.kind, axes, _joined(name, field.stored.name))
    else:
        plain = _plain(kind)
        shape = (*cells.shape, *np.shape(cells.values)[1:])
        array = np.full(shape, EMPTY[plain], TEXT if plain is str else plain)
        array[tuple(np.array(cells.places).T)] = np.array(cells.values, array.dtype)
        dataset = group.create_dataset(name or VALUE, data=array)
        scales = [group[axis] for axis, _ in zip(axes, cells.shape, strict=False)]
        if len(shape) > len(cells.shape):  # xarray wants a scale of every dimension
            numbers = f"{name or VALUE}_{PLACE}"
            group[numbers] = np.arange(shape[-1])
            group[numbers].make_scale(numbers)
            scales.append(group[numbers])
        for dimension, scale in zip(dataset.dims, scales, strict=True):
            dimension.attach_scale(scale)


def read_table(group: h5py.Group, kind: Any, axes: Sequence[str]) -> Any:
    """Return a mapping of mappings that `write_table` has written."""
    return _read(group, kind, axes, (), "")[0]


def _read(
    group: h5py.Group, kind: Any, axes: Sequence[str], shape: tuple[int, ...], name: str
) -> list[Any]:
    """Return the values at all places over the axes so far, in their order."""
    if is_mapping(kind):
        axis, (key_kind, inner) = axes[len(shape)], get_args(kind)
        keys = [_key(text, key_kind) for text in group[axis].asstr()[...]]
        shape = (*shape, len(keys))
        values = _read(group, inner, axes, shape, name)
        rows = np.arange(len(values)).reshape(-1, len(keys)).tolist()
        if (present := f"{PRESENT}_{axis}") not in group:
            return [dict(zip(keys, (values[i] for i in r), strict=True)) for r in rows]
        presence = group[present][...].ravel()
        return [
            {key: values[i] for key, i in zip(keys, row, strict=True) if presence[i]}
            for row in rows
        ]
    if fields := _fields(kind):
        columns = [
            _read(group, f.kind, axes, shape, _joined(name, f.stored.name))
            for f in fields
        ]
        return [kind(*values) for values in zip(*columns, strict=True)]
    dataset = group[name or VALUE]
    values = (dataset.asstr() if kind is str else dataset)[...]
    rows = values.reshape(-1, *values.shape[len(shape) :]).tolist()
    return rows if kind is _plain(kind) else list(map(tuple, rows))


def _keys(mappings: Iterable[Mapping[Any, Any]]) -> list[Any]:
    """Return the keys of some mappings, once each."""
    return list(dict.fromkeys(key for mapping in mappings for key in mapping))


def _text(key: Any) -> str:
    return BETWEEN.join(key) if isinstance(key, tuple) else str(key)


def _key(text: str, kind: Any) -> Any:
    return tuple(text.split(BETWEEN)) if get_origin(kind) is tuple else kind(text)


def _plain(kind: Any) -> Any:
    """Return the type of plain values, or that of the values in a tuple of these."""
    return get_args(kind)[0] if get_origin(kind) is tuple else kind


def _joined(first: str, second: str) -> str:
    return f"{first}_{second}" if first else second


def is_mapping(kind: Any) -> bool:
    """Return whether a type is that of mappings."""
    return issubclass(get_origin(kind) or kind, Mapping)


def _fields(kind: Any) -> Any:
    return hasattr(kind, "_fields") and fields_of(kind)
