"""Fields of a record that are stored: which ones, and as which attributes of HDF5.

A study of a thousand parts has tens of thousands of attributes. So they are written and
read by HDF5's own calls, which take half the time of h5py's.
"""

from functools import cache
from types import NoneType
from typing import Any, NamedTuple, get_args, get_type_hints

import h5py
import numpy as np

NAMES = {"unit": "units", "sentence": "long_name", "range": "valid_range"}  # as in CF
ELSEWHERE = "elsewhere"  # annotation of a field that `codec` does not write
BETWEEN = ", "  # parts of a key
NEEDED = object()  # no value of an attribute
TEXT = h5py.string_dtype()
PLAIN = h5py.h5t.INTEGER, h5py.h5t.FLOAT, h5py.h5t.ENUM
EMPTY = h5py.h5s.NULL
_ONE = h5py.h5s.create(h5py.h5s.SCALAR)
_TEXT = h5py.h5t.py_create(TEXT, logical=True)


class Stored(NamedTuple):
    """How a field is stored if its type does not say it; used as an annotation."""

    name: str = ""  # its own if empty
    # records of columns are stored among the attributes of these, after this prefix;
    # another attribute lists the columns in order
    columns: str | None = None
    # what the keys of a mapping of mappings are: it is stored as arrays over these
    axes: tuple[str, ...] = ()
    sentence: str = ""  # what these arrays hold


class Field(NamedTuple):
    """A field of a record."""

    name: str
    kind: Any  # its type, without None
    optional: bool
    stored: Stored  # with its name in the file


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
        stored = next(iter(notes), Stored())
        if not stored.name:
            stored = stored._replace(name=NAMES.get(name, name))
        fields.append(Field(name, kind, optional, stored))
    return tuple(fields)


def write_attribute(owner: h5py.HLObject, name: str, value: Any) -> None:
    """Write a new attribute; no texts of several are joined, none is split."""
    is_text = isinstance(value, str) or (
        isinstance(value, tuple) and isinstance(value[0], str)
    )
    values = np.array(value, dtype=TEXT if is_text else None)
    kind = _TEXT if is_text else h5py.h5t.py_create(values.dtype, logical=True)
    space = h5py.h5s.create_simple(values.shape) if values.shape else _ONE
    h5py.h5a.create(owner.id, name.encode(), kind, space).write(values)


def has_attribute(owner: h5py.HLObject, name: str) -> bool:
    """Return whether there is an attribute of this name."""
    exists: bool = h5py.h5a.exists(owner.id, name.encode())
    return exists


def read_attribute(owner: h5py.HLObject, name: str, missing: Any = NEEDED) -> Any:
    """Return an attribute as Python's own types, several as a list.

    `missing` if there is none, or without it KeyError. ValueError if it is of a kind
    that is never written.
    """
    if missing is not NEEDED and not has_attribute(owner, name):
        return missing
    attribute = h5py.h5a.open(owner.id, name.encode())
    kind, space = attribute.get_type(), attribute.get_space()
    plain = kind.get_class() in PLAIN and space.get_simple_extent_type() != EMPTY
    text = kind.get_class() == h5py.h5t.STRING and kind.is_variable_str()
    if not (plain or text) or space.get_simple_extent_ndims() > 1:
        raise ValueError(f"its attribute {name} is of another type")
    # of what is open already: an attribute opens both again
    values = np.empty(space.get_simple_extent_dims(), kind.dtype)
    attribute.read(values)
    if values.dtype != object:
        return values.tolist()
    texts = [text.decode("utf-8", "surrogateescape") for text in values.flat]
    return texts if values.shape else texts[0]


def column_of(owner: h5py.Group, name: str) -> h5py.Dataset:
    """Return a dataset of a group, faster than by an index."""
    return h5py.Dataset(h5py.h5d.open(owner.id, name.encode()))
