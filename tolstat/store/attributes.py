"""Lists of texts as attributes: nothing is joined, nothing is split."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import h5py
import numpy as np


def write_texts(item: h5py.HLObject, name: str, values: Sequence[str]) -> None:
    """Store texts as an attribute."""
    item.attrs.create(name, np.array(values, dtype=object), dtype=h5py.string_dtype())


def texts(item: h5py.HLObject, name: str) -> tuple[str, ...]:
    """Return an attribute as texts; empty if there is none."""
    return tuple(str(each) for each in item.attrs.get(name, ()))


def plain(value: Any) -> Any:
    """Return an attribute as a text, a number, or an array."""
    if isinstance(value, bytes):
        return value.decode()
    return value.item() if isinstance(value, np.generic) else value
