"""Attributes of an HDF5 object: single texts and numbers, or several in a row.

A study of a thousand parts has tens of thousands. So they are written and read by
HDF5's own calls, which take half the time of h5py's.
"""

from typing import Any

import h5py
import numpy as np

TEXT = h5py.string_dtype()
_ONE = h5py.h5s.create(h5py.h5s.SCALAR)
_TEXT = h5py.h5t.py_create(TEXT, logical=True)


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


def read_attribute(owner: h5py.HLObject, name: str) -> Any:
    """Return an attribute as Python's own types, several as a list.

    KeyError if there is none.
    """
    attribute = h5py.h5a.open(owner.id, name.encode())
    values = np.empty(attribute.shape, attribute.dtype)
    attribute.read(values)
    if values.dtype != object:
        return values.tolist()
    texts = [text.decode("utf-8", "surrogateescape") for text in values.flat]
    return texts if values.shape else texts[0]


def column_of(owner: h5py.Group, name: str) -> h5py.Dataset:
    """Return a dataset of a group, faster than by an index."""
    return h5py.Dataset(h5py.h5d.open(owner.id, name.encode()))
