"""A run file but for its rows, made in memory: HDF5 writes to no disk.

It ends the process where a disk is full.
"""

from __future__ import annotations

import io
import os
from pathlib import Path
from typing import Any, BinaryIO

import h5py
import numpy as np

from tolstat.store.codec import write_record
from tolstat.store.layout import (
    ALONE,
    CHECKS,
    CHECKSUM,
    CLOCK,
    NOMINAL,
    STATUS,
    STEPS,
    TRIAL,
    Place,
    allocate,
    encoded,
    places_of,
    write_all,
)
from tolstat.store.run_records import Reason
from tolstat.store.seal import block_for, write_seal
from tolstat.store.stored_run import Run

PAGE = 4096
ALIGNED = 64  # bytes: no value lies across two pages, where a kill could tear it


class MemoryFile(io.RawIOBase):
    """What h5py wants of a file, kept in pages; what was never written is zero."""

    def __init__(self) -> None:
        self._pages: dict[int, bytearray] = {}
        self._at = self.size = 0

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        """Go to a place."""
        start = {io.SEEK_SET: 0, io.SEEK_CUR: self._at, io.SEEK_END: self.size}
        self._at = start[whence] + offset
        return self._at

    def truncate(self, size: int | None = None) -> int:
        """Set the size; pages are few, and none is given up."""
        self.size = self._at if size is None else size
        return self.size

    def write(self, data: Any) -> int:
        """Write at the place."""
        given, done = memoryview(data).cast("B"), 0
        while done < len(given):
            number, within = divmod(self._at, PAGE)
            count = min(PAGE - within, len(given) - done)
            page = self._pages.setdefault(number, bytearray(PAGE))
            page[within : within + count] = given[done : done + count]
            self._at, done = self._at + count, done + count
        self.size = max(self.size, self._at)
        return done

    def readinto(self, buffer: Any) -> int:
        """Read from the place."""
        wanted, done = memoryview(buffer).cast("B"), 0
        left = min(len(wanted), max(self.size - self._at, 0))
        while done < left:
            number, within = divmod(self._at, PAGE)
            count = min(PAGE - within, left - done)
            page = self._pages.get(number)
            some = page[within : within + count] if page else bytes(count)
            wanted[done : done + count] = some
            self._at, done = self._at + count, done + count
        return done

    def copy_to(self, file: BinaryIO) -> None:
        """Write what there is to another file, and give it this size."""
        for number, page in sorted(self._pages.items()):
            file.seek(number * PAGE)
            write_all(file, page[: self.size - number * PAGE])
        file.truncate(self.size)


def draft_of(run: Run, path: Path) -> tuple[MemoryFile, dict[str, Place]]:
    """Make all of the file of a run but its rows, and seal it.

    The file will have this path. Returned with it is where its rows go.
    """
    draft = MemoryFile()
    block = block_for(2 * len(run.columns) + 8)
    with h5py.File(
        draft, "w", libver="v108", userblock_size=block, alignment_threshold=1,
        alignment_interval=ALIGNED,
    ) as file:  # fmt: skip
        _lay_out(file, run)
        write_record(file, run)
        for name in ("audit", "rerun"):
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
    """Say in which units trials were evaluated again, and why these."""
    for each in run.responses:
        audited["responses"][each.name].attrs["units"] = each.unit
    for chosen_by in audited.get("chosen_by", {}).values():  # as in CF
        chosen_by.attrs["flag_masks"] = np.array([each.value for each in Reason], "u1")
        names = (str(each.name).lower() for each in Reason)
        chosen_by.attrs["flag_meanings"] = " ".join(names)
