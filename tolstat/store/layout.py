"""How a run lies in its file.

At the root one dataset for each contributor, response and swept setting, for status
and, where something is integrated, for steps, with unit and sentence as attributes and
`trial` as dimension scale; its sampler may add how each was drawn. All these are
contiguous and allocated when the file is made: while trials run only the bytes of rows
change, and a kill cannot tear the file. The nominal machine, which is no trial, lies in
the group `nominal`. The group `checks` holds a checksum of each trial, written before
its status, one of the nominal machine, and how long the run took so far. Before all of
it, in the user block, lies the seal of what is no row.

What else a run says lies as `codec` writes the fields of `Run`. What is known at the
end comes with the whole file, written aside and renamed.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any, BinaryIO, NamedTuple

import h5py
import numpy as np
from numpy.typing import NDArray

TRIAL, STATUS, STEPS = "trial", "status", "steps"
NOMINAL = "nominal"  # a group
CHECKS = "checks"  # a group
CHECKSUM, ALONE = f"{CHECKS}/trial", f"{CHECKS}/nominal"  # of a trial, of the nominal
CLOCK = f"{CHECKS}/clock"
Column = NDArray[Any]


def allocate(
    group: h5py.Group, name: str, shape: tuple[int, ...], dtype: Any, sentence: str = ""
) -> h5py.Dataset:
    """Make a contiguous dataset whose space exists at once."""
    plan = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    plan.set_layout(h5py.h5d.CONTIGUOUS)
    plan.set_alloc_time(h5py.h5d.ALLOC_TIME_EARLY)
    plan.set_fill_time(h5py.h5d.FILL_TIME_NEVER)
    space = h5py.h5s.create_simple(shape) if shape else h5py.h5s.create(h5py.h5s.SCALAR)
    kind = h5py.h5t.py_create(np.dtype(dtype))
    made = h5py.Dataset(
        h5py.h5d.create(group.id, name.encode(), kind, space, dcpl=plan)
    )
    if sentence:
        made.attrs["long_name"] = sentence
    return made


def encoded(values: NDArray[Any]) -> NDArray[Any]:
    """Return values as a file holds them."""
    return np.char.encode(values, "utf-8") if values.dtype.kind == "U" else values


def decoded(values: NDArray[Any]) -> NDArray[Any]:
    """Return values that a file holds; half a character is no reason to refuse it."""
    text = values.dtype.kind == "S"
    return np.char.decode(values, "utf-8", "replace") if text else values


class Place(NamedTuple):
    """Where a column lies: offset in the file, NumPy type, and how many values."""

    offset: int
    dtype: np.dtype[Any]
    length: int

    @property
    def hole(self) -> tuple[int, int]:
        """Its first byte, and the next after it."""
        return self.offset, self.offset + self.dtype.itemsize * self.length


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


def write_all(file: BinaryIO, data: Any) -> None:
    """Write all of it: an unbuffered file may take a part where the disk gets full."""
    left = memoryview(data).cast("B")
    while left:
        left = left[file.write(left) :]
