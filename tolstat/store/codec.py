"""Records written to HDF5 and read back, by the types of their fields.

Texts, numbers and tuples of these are attributes, arrays are datasets. A mapping is a
group of these, and so is a tuple of records, by their names. A mapping of mappings is a
group of arrays over their keys. A record of attributes alone is stored among the
attributes of its owner, with the name of the field in front (`limit_words`). Any other
record is a group. None, False and empty values are not written.
"""

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, get_args, get_origin

import h5py

from tolstat.store.stored_fields import (
    Field,
    column_of,
    fields_of,
    has_attribute,
    read_attribute,
    write_attribute,
)
from tolstat.store.tables import is_mapping, is_place, read_table, write_table

PLAIN = (str, bool, int, float)


def write_record(owner: h5py.HLObject, record: Any, prefix: str = "") -> None:
    """Write the fields of a record, with a prefix before the name of each."""
    kind: Any = type(record)
    for field in fields_of(kind):
        value, stored = getattr(record, field.name), field.stored
        name = prefix + stored.name
        empty = isinstance(value, bool | str | Sequence | Mapping) and not value
        if value is None or empty:
            continue
        if stored.columns is not None:
            columns = _by_key(value)
            write_attribute(owner, name, tuple(columns))
            for column, item in columns.items():
                write_record(column_of(owner, column), item, stored.columns)
        elif stored.axes:
            group = owner.create_group(name)
            write_attribute(group, "long_name", stored.sentence)
            write_table(group, value, field.kind, stored.axes)
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
            _put(group, str(key), item, _inner(kind))
    elif not _is_attribute(kind):
        owner[name] = value
    else:  # of a subclass, too
        write_attribute(owner, name, kind(value) if kind in PLAIN else value)


def read_fields(owner: h5py.HLObject, kind: Any, prefix: str = "") -> dict[str, Any]:
    """Return the stored fields of a record; KeyError if a required one is missing."""
    fields = fields_of(kind)
    return {f.name: _read(owner, prefix + f.stored.name, f) for f in fields}


def _read(owner: h5py.HLObject, name: str, field: Field) -> Any:
    """Return the value of a field."""
    kind, prefix, (_, before, axes, _) = field.kind, f"{name}_", field.stored
    if before is not None:
        inner = _inner(kind)
        columns = read_attribute(owner, name, ())
        values = [
            inner(**read_fields(column_of(owner, column), inner, before))
            for column in columns
        ]
        return _collected(kind, columns, values)
    if _is_flat(kind):
        first = prefix + fields_of(kind)[0].stored.name
        if field.optional and not has_attribute(owner, first):
            return None
        return kind(**read_fields(owner, kind, prefix))
    if axes and name in owner:
        return read_table(owner[name], kind, axes)
    if has_attribute(owner, name) if _is_attribute(kind) else name in owner:
        return _take(owner, name, kind)
    if field.optional:
        return None
    if kind in (bool, str):
        return kind()
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
        keys = [key for key in keys if not is_place(key, group.name)]
        return _collected(kind, keys, [_take(group, key, inner) for key in keys])
    if not _is_attribute(kind):
        return owner[name][...]
    return _typed(read_attribute(owner, name), kind, name)


def _typed(value: Any, kind: Any, name: str) -> Any:
    """Return a plain value, or a tuple of these, if it is of its type."""
    if kind not in PLAIN and isinstance(value, list):
        inner, *others = get_args(kind)
        if others == [...] or len(value) == len(others) + 1:
            return tuple(_typed(item, inner, name) for item in value)
    elif type(value) is kind or (kind is float and type(value) is int):
        return kind(value)
    raise ValueError(f"its attribute {name} is of another type")


def _by_key(values: Any) -> Mapping[Any, Any]:
    """Return the values of a mapping or of a tuple of records by their keys."""
    return values if isinstance(values, Mapping) else {v.name: v for v in values}


def _collected(kind: Any, keys: Iterable[str], values: Iterable[Any]) -> Any:
    """Return values as a mapping, or as a tuple of records, which know their names."""
    if not is_mapping(kind):
        return tuple(values)
    key_kind = get_args(kind)[0]
    return {key_kind(k): v for k, v in zip(keys, values, strict=True)}


def _is_record(kind: Any) -> bool:
    return dataclasses.is_dataclass(kind) or hasattr(kind, "_fields")


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
    return is_mapping(kind) or (get_origin(kind) is tuple and not _is_attribute(kind))


def _inner(kind: Any) -> Any:
    """Return the type of the values in a mapping or a tuple."""
    return get_args(kind)[1 if is_mapping(kind) else 0]
