"""Records written to HDF5 and read back, by the types of their fields.

Texts, numbers and tuples of these are attributes, arrays are datasets. A mapping or a
list is a group of these. A record of attributes alone is stored among the attributes of
its owner, with the name of the field in front (`limit_words`). Any other record is a
group. None and empty values are not written.
"""

import dataclasses
from collections.abc import Mapping, Sequence
from functools import cache
from types import NoneType
from typing import Any, NamedTuple, get_args, get_origin, get_type_hints

import h5py
import numpy as np

NAMES = {"unit": "units", "sentence": "long_name", "range": "valid_range"}  # as in CF
PLAIN = (str, bool, int, float)
BETWEEN = ", "  # parts of a key


class Stored(NamedTuple):
    """How a field is stored if its type does not say it; used as an annotation."""

    name: str = ""  # its own if empty
    # records of columns are stored among the attributes of these, after this prefix;
    # another attribute lists the columns in order
    columns: str | None = None


ELSEWHERE = "elsewhere"  # annotation of a field that this module does not write


class Field(NamedTuple):
    """A field of a record."""

    name: str
    kind: Any  # its type, without None
    optional: bool
    stored: Stored


@cache
def fields_of(record: Any) -> tuple[Field, ...]:
    """Return the fields of a record that are stored."""
    found = []
    for name, hint in get_type_hints(record, include_extras=True).items():
        noted = getattr(hint, "__metadata__", ())
        if ELSEWHERE in noted:
            continue
        kind = get_args(hint)[0] if noted else hint
        if optional := NoneType in get_args(kind):
            kind = get_args(kind)[0]
        how = next(iter(noted), Stored())
        how = how._replace(name=how.name or NAMES.get(name, name))
        found.append(Field(name, kind, optional, how))
    return tuple(found)


def write_record(place: h5py.HLObject, record: Any, prefix: str = "") -> None:
    """Write the fields of a record, with a prefix before the name of each."""
    kind: Any = type(record)
    for field in fields_of(kind):
        write(place, prefix + field.stored.name, getattr(record, field.name), field)


def read_record(place: h5py.HLObject, kind: Any, prefix: str = "") -> Any:
    """Return a record; KeyError if a required field is missing."""
    fields = fields_of(kind)
    return kind(**{f.name: read(place, prefix + f.stored.name, f) for f in fields})


def write(place: h5py.HLObject, name: str, value: Any, field: Field) -> None:
    """Write the value of a field."""
    if value is None or (isinstance(value, str | Sequence | Mapping) and not value):
        return
    if field.stored.columns is not None:
        named = value if isinstance(value, Mapping) else {e.name: e for e in value}
        _put(place, name, tuple(named), tuple[str, ...])
        for column, each in named.items():
            write_record(place[column], each, field.stored.columns)
    elif _is_flat(field.kind):
        write_record(place, value, f"{name}_")
    else:
        _put(place, name, value, field.kind)


def read(place: h5py.HLObject, name: str, field: Field) -> Any:
    """Return the value of a field."""
    kind = field.kind
    if field.stored.columns is not None:
        columns = place.attrs.get(name, ())
        prefix, of = field.stored.columns, _inner(kind)
        records = [read_record(place[column], of, prefix) for column in columns]
        named = dict(zip(columns, records, strict=True))
        return named if _is_mapping(kind) else tuple(records)
    if _is_flat(kind):
        first = fields_of(kind)[0].stored.name
        there = not field.optional or f"{name}_{first}" in place.attrs
        return read_record(place, kind, f"{name}_") if there else None
    if name in (place.attrs if _is_attribute(kind) else place):
        return _take(place, name, kind)
    if field.optional:
        return None
    if kind is str or get_origin(kind) is tuple:
        return kind()
    if _is_group(kind):
        return {} if _is_mapping(kind) else []
    raise KeyError(f"{place.name} has no {name}")


def _put(place: h5py.HLObject, name: str, value: Any, kind: Any) -> None:
    """Write a value under its name."""
    if _is_record(kind):
        write_record(place.create_group(name), value)
    elif _is_group(kind):
        group = place.create_group(name, track_order=True)
        for key, each in value.items() if _is_mapping(kind) else _numbered(value):
            key = BETWEEN.join(key) if isinstance(key, tuple) else str(key)
            _put(group, key, each, _inner(kind))
    elif not _is_attribute(kind):
        place[name] = value
    elif kind in PLAIN:
        place.attrs[name] = str(value) if kind is str else value
    elif _inner(kind) is str:  # no texts are joined, none is split
        array = np.array(value, dtype=object)
        place.attrs.create(name, array, dtype=h5py.string_dtype())
    else:
        place.attrs[name] = np.array(value)


def _take(place: h5py.HLObject, name: str, kind: Any) -> Any:
    """Return a value that `_put` has written."""
    if _is_record(kind):
        return read_record(place[name], kind)
    if _is_group(kind):
        group, inner = place[name], _inner(kind)
        keys: Any = list(group.attrs if _is_attribute(inner) else group)
        values = [_take(group, key, inner) for key in keys]
        if not _is_mapping(kind):
            return values if get_origin(kind) is list else tuple(values)
        typed = get_args(kind)[0]
        if typed is int:
            keys = map(int, keys)
        elif get_origin(typed) is tuple:
            keys = (tuple(key.split(BETWEEN)) for key in keys)
        return dict(zip(keys, values, strict=True))
    if not _is_attribute(kind):
        return place[name][...]
    value = place.attrs[name]
    return kind(value) if kind in PLAIN else tuple(value.tolist())


def _numbered(values: Sequence[Any]) -> list[tuple[Any, Any]]:
    """Return the key of each value, its name or its number, and the value."""
    return [(getattr(each, "name", i), each) for i, each in enumerate(values)]


def _is_record(kind: Any) -> bool:
    return dataclasses.is_dataclass(kind) or hasattr(kind, "_fields")


def _is_mapping(kind: Any) -> bool:
    origin = get_origin(kind)
    return isinstance(origin, type) and issubclass(origin, Mapping)


def _is_attribute(kind: Any) -> bool:
    """Return whether values of a type are attributes: plain ones, tuples of them."""
    if get_origin(kind) is tuple:
        return get_args(kind)[0] in PLAIN
    return kind in PLAIN


def _is_flat(kind: Any) -> bool:
    """Return whether a type is a record of attributes alone."""
    if not _is_record(kind):
        return False
    kinds = [field.kind for field in fields_of(kind)]
    return all(_is_attribute(each) or _is_flat(each) for each in kinds)


def _is_group(kind: Any) -> bool:
    """Return whether a type holds several values with a key each."""
    return _is_mapping(kind) or (
        get_origin(kind) in (list, tuple) and not _is_attribute(kind)
    )


def _inner(kind: Any) -> Any:
    """Return the type of the values in a mapping or a list."""
    return get_args(kind)[1 if _is_mapping(kind) else 0]
