"""The rows of a run file: what changes while trials run, as bytes at known places.

HDF5 has no part in it: a full disk is an error that can be told, and no kill leaves
anything of HDF5's half written.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any, BinaryIO, NamedTuple

import h5py
import numpy as np
from numpy.typing import NDArray

from tolstat.store.layout import (
    ALONE,
    CHECKSUM,
    CLOCK,
    NOMINAL,
    STATUS,
    STEPS,
    TRIAL,
)
from tolstat.store.memory_file import write_all

Column = NDArray[Any]


class Place(NamedTuple):
    """Where a column lies: offset in the file, NumPy type, and how many values."""

    offset: int
    dtype: np.dtype[Any]
    length: int

    @property
    def hole(self) -> tuple[int, int]:
        """Where it begins, and how many bytes it has."""
        return self.offset, self.dtype.itemsize * self.length


def columns_of(file: h5py.File) -> list[str]:
    """Name the columns of a run whose values make up a row, status last."""
    every = [name for name, item in file.items() if isinstance(item, h5py.Dataset)]
    return [*(name for name in every if name not in (TRIAL, STATUS)), STATUS]


def nominal_columns_of(file: h5py.File) -> list[str]:
    """Name the columns that say how the nominal machine ended."""
    names = (*sorted(file.attrs.get("responses", ())), STATUS, STEPS)
    return [f"{NOMINAL}/{name}" for name in names if name in file]


def places_of(file: h5py.File) -> dict[str, Place]:
    """Find where the rows lie: columns, the nominal machine, checksums, clock."""
    found = {}
    for name in (*columns_of(file), CHECKSUM, ALONE, CLOCK, *nominal_columns_of(file)):
        item = file[name]
        found[name] = Place(item.id.get_offset(), item.dtype, item.size)
    return found


class Rows:
    """The rows of an open, unbuffered file."""

    def __init__(self, file: BinaryIO, places: Mapping[str, Place]) -> None:
        self.file, self.places = file, places
        nominal = f"{NOMINAL}/"
        own = [n for n in places if n not in (CHECKSUM, ALONE, CLOCK)]
        self.columns = [n for n in own if not n.startswith(nominal)]
        self.of_nominal = [n for n in own if n.startswith(nominal)]

    def read(self, name: str, first: int = 0, stop: int | None = None) -> Column:
        """Return values of a column."""
        place = self.places[name]
        stop = place.length if stop is None else stop
        size = place.dtype.itemsize
        self.file.seek(place.offset + first * size)
        data = bytearray((stop - first) * size)
        left = memoryview(data)
        while left and (count := self.file.readinto(left)):  # type: ignore[attr-defined]
            left = left[count:]
        return np.frombuffer(data, place.dtype)

    def write(self, name: str, values: Any, first: int = 0) -> None:
        """Write values of a column, from a row on."""
        place = self.places[name]
        data = np.ascontiguousarray(values, place.dtype).reshape(-1)
        self.file.seek(place.offset + first * place.dtype.itemsize)
        write_all(self.file, data.view(np.uint8))

    def sync(self) -> None:
        """Bring everything to the disk."""
        os.fsync(self.file.fileno())
