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
    fields = []
    for name, hint in get_type_hints(record, include_extras=True).items():
        noted = getattr(hint, "__metadata__", ())
        if ELSEWHERE in noted:
            continue
        kind = get_args(hint)[0] if noted else hint
        if optional := NoneType in get_args(kind):
            kind = get_args(kind)[0]
        how = next(iter(noted), Stored())
        how = how._replace(name=how.name or NAMES.get(name, name))
        fields.append(Field(name, kind, optional, how))
    return tuple(fields)


def write_record(owner: h5py.HLObject, record: Any, prefix: str = "") -> None:
    """Write the fields of a record, with a prefix before the name of each."""
    kind: Any = type(record)
    for field in fields_of(kind):
        write(owner, prefix + field.stored.name, getattr(record, field.name), field)


def read_record(owner: h5py.HLObject, kind: Any, prefix: str = "") -> Any:
    """Return a record; KeyError if a required field is missing."""
    fields = fields_of(kind)
    return kind(**{f.name: read(owner, prefix + f.stored.name, f) for f in fields})


def write(owner: h5py.HLObject, name: str, value: Any, field: Field) -> None:
    """Write the value of a field."""
    if value is None or (isinstance(value, str | Sequence | Mapping) and not value):
        return
    if field.stored.columns is not None:
        records = value if isinstance(value, Mapping) else {r.name: r for r in value}
        _put(owner, name, tuple(records), tuple[str, ...])
        for column, record in records.items():
            write_record(owner[column], record, field.stored.columns)
    elif _is_flat(field.kind):
        write_record(owner, value, f"{name}_")
    else:
        _put(owner, name, value, field.kind)


def read(owner: h5py.HLObject, name: str, field: Field) -> Any:
    """Return the value of a field."""
    kind = field.kind
    if field.stored.columns is not None:
        columns = owner.attrs.get(name, ())
        prefix, inner = field.stored.columns, _inner(kind)
        records = {c: read_record(owner[c], inner, prefix) for c in columns}
        return records if _is_mapping(kind) else tuple(records.values())
    if _is_flat(kind):
        first = fields_of(kind)[0].stored.name
        missing = field.optional and f"{name}_{first}" not in owner.attrs
        return None if missing else read_record(owner, kind, f"{name}_")
    if name in (owner.attrs if _is_attribute(kind) else owner):
        return _take(owner, name, kind)
    if field.optional:
        return None
    if kind is str or get_origin(kind) is tuple:
        return kind()
    if _is_group(kind):
        return {} if _is_mapping(kind) else []
    raise KeyError(f"{owner.name} has no {name}")


def _put(owner: h5py.HLObject, name: str, value: Any, kind: Any) -> None:
    """Write a value under its name."""
    if _is_record(kind):
        write_record(owner.create_group(name), value)
    elif _is_group(kind):
        group = owner.create_group(name, track_order=True)
        for key, item in value.items() if _is_mapping(kind) else _numbered(value):
            key = BETWEEN.join(key) if isinstance(key, tuple) else str(key)
            _put(group, key, item, _inner(kind))
    elif not _is_attribute(kind):
        owner[name] = value
    elif kind in PLAIN:
        owner.attrs[name] = kind(value)  # of a subclass, too
    elif _inner(kind) is str:  # no texts are joined, none is split
        array = np.array(value, dtype=object)
        owner.attrs.create(name, array, dtype=h5py.string_dtype())
    else:
        owner.attrs[name] = np.array(value)


def _take(owner: h5py.HLObject, name: str, kind: Any) -> Any:
    """Return a value that `_put` has written."""
    if _is_record(kind):
        return read_record(owner[name], kind)
    if _is_group(kind):
        group, inner = owner[name], _inner(kind)
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
        return owner[name][...]
    value = owner.attrs[name]
    return kind(value) if kind in PLAIN else tuple(value.tolist())


def _numbered(values: Sequence[Any]) -> list[tuple[Any, Any]]:
    """Return the key of each value, its name or its number, and the value."""
    return [(getattr(value, "name", i), value) for i, value in enumerate(values)]


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
    return all(_is_attribute(inner) or _is_flat(inner) for inner in kinds)


def _is_group(kind: Any) -> bool:
    """Return whether a type holds several values with a key each."""
    return _is_mapping(kind) or (
        get_origin(kind) in (list, tuple) and not _is_attribute(kind)
    )


def _inner(kind: Any) -> Any:
    """Return the type of the values in a mapping or a list."""
    return get_args(kind)[1 if _is_mapping(kind) else 0]
