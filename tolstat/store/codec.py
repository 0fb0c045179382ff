"""Records written to HDF5 and read back, by the types of their fields.

Texts, numbers and tuples of these are attributes, arrays are datasets. A mapping is a
group of these, and so is a tuple of records, by their names. A record of attributes
alone is stored among the attributes of its owner, with the name of the field in front
(`limit_words`). Any other record is a group. None and empty values are not written.
"""

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
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
    stored: str  # its name in the file
    columns: str | None  # as in `Stored`


@cache
def fields_of(record: Any) -> tuple[Field, ...]:
    """Return the fields of a record that are stored."""
    fields = []
    for name, hint in get_type_hints(record, include_extras=True).items():
        notes = getattr(hint, "__metadata__", ())
        if ELSEWHERE in notes:
            continue
        kind = get_args(hint)[0] if notes else hint
        if optional := NoneType in get_args(kind):
            kind = get_args(kind)[0]
        stored, columns = next(iter(notes), Stored())
        stored = stored or NAMES.get(name, name)
        fields.append(Field(name, kind, optional, stored, columns))
    return tuple(fields)


def write_record(owner: h5py.HLObject, record: Any, prefix: str = "") -> None:
    """Write the fields of a record, with a prefix before the name of each."""
    kind: Any = type(record)
    for field in fields_of(kind):
        value, name = getattr(record, field.name), prefix + field.stored
        if value is None or (isinstance(value, str | Sequence | Mapping) and not value):
            continue
        if field.columns is not None:
            columns = _by_key(value)
            _put(owner, name, tuple(columns), tuple[str, ...])
            for column, item in columns.items():
                write_record(owner[column], item, field.columns)
        elif _is_flat(field.kind):
            write_record(owner, value, f"{name}_")
        else:
            _put(owner, name, value, field.kind)


def _put(owner: h5py.HLObject, name: str, value: Any, kind: Any) -> None:
    """Write a value under its name."""
    if _is_record(kind):
        write_record(owner.create_group(name), value)
    elif _is_group(kind):
        group = owner.create_group(name, track_order=True)
        for key, item in _by_key(value).items():
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


def read_fields(owner: h5py.HLObject, kind: Any, prefix: str = "") -> dict[str, Any]:
    """Return the stored fields of a record; KeyError if a required one is missing."""
    fields = fields_of(kind)
    return {f.name: _read(owner, prefix + f.stored, f) for f in fields}


def _read(owner: h5py.HLObject, name: str, field: Field) -> Any:
    """Return the value of a field."""
    kind, prefix = field.kind, f"{name}_"
    if field.columns is not None:
        inner, columns = _inner(kind), owner.attrs.get(name, ())
        values = [inner(**read_fields(owner[c], inner, field.columns)) for c in columns]
        return _collected(kind, columns, values)
    if _is_flat(kind):
        missing = prefix + fields_of(kind)[0].stored not in owner.attrs
        if missing and field.optional:
            return None
        return kind(**read_fields(owner, kind, prefix))
    if name in (owner.attrs if _is_attribute(kind) else owner):
        return _take(owner, name, kind)
    if field.optional:
        return None
    if kind is str:
        return ""
    if _is_group(kind) or get_origin(kind) is tuple:
        return _collected(kind, (), ())
    raise KeyError(f"{owner.name} has no {name}")


def _take(owner: h5py.HLObject, name: str, kind: Any) -> Any:
    """Return a value that `_put` has written."""
    if _is_record(kind):
        return kind(**read_fields(owner[name], kind))
    if _is_group(kind):
        group, inner = owner[name], _inner(kind)
        keys = list(group.attrs if _is_attribute(inner) else group)
        return _collected(kind, keys, [_take(group, key, inner) for key in keys])
    if not _is_attribute(kind):
        return owner[name][...]
    value = owner.attrs[name]
    return kind(value) if kind in PLAIN else tuple(value.tolist())


def _by_key(values: Any) -> Mapping[Any, Any]:
    """Return the values of a mapping or of a tuple of records by their keys."""
    return values if isinstance(values, Mapping) else {v.name: v for v in values}


def _collected(kind: Any, keys: Iterable[str], values: Iterable[Any]) -> Any:
    """Return values as a mapping, or as a tuple of records, which know their names."""
    if not _is_mapping(kind):
        return tuple(values)
    key_kind = get_args(kind)[0]
    if get_origin(key_kind) is tuple:
        return {tuple(k.split(BETWEEN)): v for k, v in zip(keys, values, strict=True)}
    return {key_kind(k): v for k, v in zip(keys, values, strict=True)}


def _is_record(kind: Any) -> bool:
    return dataclasses.is_dataclass(kind) or hasattr(kind, "_fields")


def _is_mapping(kind: Any) -> bool:
    return issubclass(get_origin(kind) or kind, Mapping)


def _is_attribute(kind: Any) -> bool:
    """Return whether values of a type are attributes: plain ones, tuples of them."""
    return (get_args(kind)[0] if get_origin(kind) is tuple else kind) in PLAIN


def _is_flat(kind: Any) -> bool:
    """Return whether a type is a record of attributes alone."""
    return _is_record(kind) and all(
        _is_attribute(field.kind) or _is_flat(field.kind) for field in fields_of(kind)
    )


def _is_group(kind: Any) -> bool:
    """Return whether a type holds several values with a key each."""
    return _is_mapping(kind) or (get_origin(kind) is tuple and not _is_attribute(kind))


def _inner(kind: Any) -> Any:
    """Return the type of the values in a mapping or a tuple."""
    return get_args(kind)[1 if _is_mapping(kind) else 0]
