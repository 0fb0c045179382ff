"""Layout of a run file.

The root has one dataset for each contributor, response and swept setting, for the
status and, if trials are integrated, for steps. A sampler may add columns. Attributes
give unit and sentence; `trial` is the dimension scale. All these are contiguous and
allocated when the file is made: while trials run only bytes of rows change, so a kill
cannot tear the file. The nominal trial is in the group `nominal`. The group `checks`
holds a checksum of each trial, written before its status, one of the nominal trial, and
the duration of the run so far. The user block, before all of it, holds the seal of
everything but the rows.

`codec` writes the other fields of `Run`. Results known at the end come with a new file,
written under a temporary name and renamed.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, NamedTuple

import h5py
import numpy as np
from numpy.typing import NDArray

from tolstat.store.codec import write_record
from tolstat.store.memory_file import MemoryFile, write_all
from tolstat.store.run_records import Reason
from tolstat.store.seal import block_for, write_seal

if TYPE_CHECKING:
    from tolstat.store.stored_run import Run

TRIAL, STATUS, STEPS = "trial", "status", "steps"
NOMINAL = "nominal"  # a group
CHECKS = "checks"  # a group
CHECKSUM, ALONE = f"{CHECKS}/trial", f"{CHECKS}/nominal"  # of a trial, of the nominal
CLOCK = f"{CHECKS}/clock"
Column = NDArray[Any]
ALIGNED = 64  # bytes: no value lies across two pages, where a kill could tear it


def allocate(
    group: h5py.Group, name: str, shape: tuple[int, ...], dtype: Any, sentence: str = ""
) -> h5py.Dataset:
    """Make a contiguous dataset whose space exists at once."""
    plan = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    plan.set_alloc_time(h5py.h5d.ALLOC_TIME_EARLY)
    plan.set_fill_time(h5py.h5d.FILL_TIME_NEVER)
    # create_dataset allocates a scalar late, whatever its plan says
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
    """Return decoded values of a file; broken characters are replaced."""
    text = values.dtype.kind == "S"
    return np.char.decode(values, "utf-8", "replace") if text else values


class Place(NamedTuple):
    """Where a column lies: offset in the file, NumPy type, and how many values."""

    offset: int
    dtype: np.dtype[Any]
    length: int

    @property
    def hole(self) -> tuple[int, int]:
        """Its first byte, and the first byte after it."""
        return self.offset, self.offset + self.dtype.itemsize * self.length


def columns_of(file: h5py.File) -> list[str]:
    """Return the names of the columns that make up a row, status last."""
    every = [name for name, item in file.items() if isinstance(item, h5py.Dataset)]
    return [*(name for name in every if name not in (TRIAL, STATUS)), STATUS]


def nominal_columns_of(file: h5py.File) -> list[str]:
    """Return the names of the columns about the nominal trial."""
    names = (*sorted(file.attrs.get("responses", ())), STATUS, STEPS)
    return [f"{NOMINAL}/{name}" for name in names if name in file]


def places_of(file: h5py.File) -> dict[str, Place]:
    """Return the places of rows: columns, nominal trial, checksums, clock."""
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

    def read(self, name: str) -> Column:
        """Return a column."""
        place = self.places[name]
        self.file.seek(place.offset)
        found: Column = np.fromfile(self.file, place.dtype, place.length)
        return found

    def write(self, name: str, values: Any, first: int = 0) -> None:
        """Write values of a column, from a row on."""
        place = self.places[name]
        data = np.ascontiguousarray(values, place.dtype).reshape(-1)
        self.file.seek(place.offset + first * place.dtype.itemsize)
        write_all(self.file, data.view(np.uint8))

    def sync(self) -> None:
        """Bring everything to the disk."""
        os.fsync(self.file.fileno())


def draft_of(run: Run, path: Path) -> tuple[MemoryFile, dict[str, Place]]:
    """Return the sealed file of a run without its rows, and the places of these.

    `path` is where the file will be.
    """
    draft = MemoryFile()
    block = block_for(2 * len(run.columns) + 8)
    with h5py.File(
        draft, "w", libver="v108", userblock_size=block, alignment_threshold=1,
        alignment_interval=ALIGNED,
    ) as file:  # fmt: skip
        _lay_out(file, run)
        write_record(file, run)
        for name in ("audit", "audit/third", "rerun"):
            if name in file:
                _describe(file[name], run)
        if run.study_file:  # from here: both may be moved together
            file.attrs["study_file"] = os.path.relpath(run.study_file, path.parent)
        places = places_of(file)
    write_seal(draft, block, [each.hole for each in places.values()])
    return draft, places


def _lay_out(file: h5py.File, run: Run) -> None:
    """Make the datasets."""
    trials = run.trials
    checks = file.create_group(CHECKS)
    checks.attrs["long_name"] = "what tells whether the file is as it was written"
    sentence = "checksum of all that is stored of a trial; 0 for none"
    allocate(file, CHECKSUM, (trials,), np.uint64, sentence)
    allocate(file, ALONE, (), np.uint64, "checksum of the nominal machine")
    sentence = "seconds the run took so far, last written at, checksum"
    allocate(file, CLOCK, (3,), np.float64, sentence)
    index = allocate(file, TRIAL, (trials,), np.int64, "number of the trial")
    index[...] = np.arange(trials)
    index.make_scale(TRIAL)
    nominal = file.create_group(NOMINAL)
    nominal.attrs["long_name"] = "the machine without deviations; it is no trial"
    for each in run.contributors:
        allocate(nominal, each.name, (), np.float64)[...] = 0.0
        write_record(nominal[each.name], each)
    for name, values in run.columns.items():
        dtype = encoded(values).dtype
        column = allocate(file, name, (trials,), dtype)
        column.dims[0].attach_scale(index)
        if name in (STATUS, STEPS):
            allocate(nominal, name, (), dtype)
    for response in run.responses:
        allocate(nominal, response.name, (), np.float64)
        write_record(nominal[response.name], response)
    for column in run.described:
        file[column.name].attrs["role"] = type(column).__name__.lower()
    if STEPS in file:
        file[STEPS].attrs["long_name"] = "integration steps, rejected ones included"
    status = file[STATUS].attrs  # as the CF conventions have it, for xarray
    status["long_name"] = "how the trial ended"
    status["flag_values"] = np.array(list(run.words), np.uint8)
    words = [word.replace(" ", "_") for word in run.words.values()]
    status["flag_meanings"] = " ".join(words)


def _describe(audited: h5py.Group, run: Run) -> None:
    """Store the units of audited trials, and the reasons for choosing them."""
    for each in run.responses:
        audited["responses"][each.name].attrs["units"] = each.unit
    for chosen_by in audited.get("chosen_by", {}).values():  # as in CF
        chosen_by.attrs["flag_masks"] = np.array([each.value for each in Reason], "u1")
        names = (str(each.name).lower() for each in Reason)
        chosen_by.attrs["flag_meanings"] = " ".join(names)
