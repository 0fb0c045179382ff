"""Layout of a run file.

The root has one dataset for each contributor, response and swept setting, for the
status and, if trials are integrated, for steps. A sampler may add columns. Attributes
give unit and sentence; `trial` is the dimension scale. All these are contiguous and
allocated when the file is made: while trials run only bytes of rows change, so a kill
cannot tear the file. The nominal trial is in the group `nominal`. The group `checks`
holds a checksum of each trial, written before its status, one of the nominal trial, and
the duration of the run so far. The user block, before all of it, holds the seal of
everything but the rows.

`codec` writes the other fields of `Run`, and `tables` those that are mappings of
mappings: slopes, worst cases and halved tolerances are few arrays, however many parts
and limits there are. Results known at the end come with a new file, written under a
temporary name and renamed.
"""

import errno
import io
import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

import h5py
import numpy as np
from numpy.typing import NDArray

from tolstat.regular_files import read_exactly
from tolstat.store.codec import write_record
from tolstat.store.integrity import Hole, around, block_for, write_all, write_seal
from tolstat.store.run_records import STATUS, STEPS, Reason
from tolstat.store.stored_fields import column_of, read_attribute, write_attribute
from tolstat.store.stored_run import Run
from tolstat.store.tables import place_name

TRIAL = "trial"
NOMINAL, CHECKS = "nominal", "checks"  # groups
# of a trial, of the nominal; no dataset has the name of a coordinate above it
CHECKSUM, ALONE = f"{CHECKS}/checksum", f"{CHECKS}/nominal"
CLOCK = f"{CHECKS}/clock"
LOCKINGS = False, None, True, "best-effort"  # how h5py may lock a file
ROOM = 1 << 16  # bytes of a file in memory at first; it doubles when used up
METADATA = 1 << 26  # bytes, hardly exceeded by all that a file holds beside its rows
Column = NDArray[Any]
# attributes of a dataset that lie together: a separate heap for them takes four times
# as long; and fewest in such a heap
TOGETHER = 100, 90
ALIGNED = 64  # bytes: no value lies across two pages, where a kill could tear it


class MemoryFile(io.RawIOBase):
    """A file for h5py, which would end the process if a disk is full.

    Bytes that were never written are zero.

    Room that is never written costs no memory, so give enough at once.
    """

    def __init__(self, room: int = ROOM) -> None:
        self._data = np.zeros(room, np.uint8)
        self._position = self.size = 0

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        """Go to a position."""
        self._position = offset + (0, self._position, self.size)[whence]
        return self._position

    def truncate(self, size: int | None = None) -> int:
        """Set the size."""
        self.size = self._position if size is None else size
        self._make_room(self.size)
        return self.size

    def write(self, data: Any) -> int:
        """Write at the position."""
        source = np.frombuffer(data, np.uint8)
        stop = self._position + len(source)
        self._make_room(stop)
        self._data[self._position : stop] = source
        self._position, self.size = stop, max(self.size, stop)
        return len(source)

    def readinto(self, buffer: Any) -> int:
        """Read from the position."""
        source = self._data[self._position : self.size][: len(buffer)]
        np.frombuffer(buffer, np.uint8)[: len(source)] = source
        self._position += len(source)
        return len(source)

    def _make_room(self, size: int) -> None:
        if size > len(self._data):
            more = np.zeros(max(size, len(self._data)), np.uint8)
            self._data = np.concatenate([self._data, more])

    def copy_to(self, file: BinaryIO, holes: Iterable[Hole] = ()) -> None:
        """Write all but the holes to another file, and give it this size."""
        for first, stop in around(holes, self.size):
            file.seek(first)
            write_all(file, self._data[first:stop])
        file.truncate(self.size)


def allocate(
    group: h5py.Group, name: str, shape: tuple[int, ...], dtype: Any, sentence: str = ""
) -> h5py.Dataset:
    """Make a contiguous dataset whose space exists at once."""
    plan = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    plan.set_alloc_time(h5py.h5d.ALLOC_TIME_EARLY)
    plan.set_fill_time(h5py.h5d.FILL_TIME_NEVER)
    plan.set_attr_phase_change(*TOGETHER)
    # create_dataset allocates a scalar late, whatever its plan says
    space = h5py.h5s.create_simple(shape) if shape else h5py.h5s.create(h5py.h5s.SCALAR)
    kind = h5py.h5t.py_create(np.dtype(dtype))
    dataset = h5py.Dataset(
        h5py.h5d.create(group.id, name.encode(), kind, space, dcpl=plan)
    )
    if sentence:
        write_attribute(dataset, "long_name", sentence)
    return dataset


def encoded(values: NDArray[Any]) -> NDArray[Any]:
    """Return values as a file holds them."""
    return np.char.encode(values, "utf-8") if values.dtype.kind == "U" else values


def decoded(values: NDArray[Any]) -> NDArray[Any]:
    """Return decoded values of a file; broken characters are replaced."""
    text = values.dtype.kind == "S"
    return np.char.decode(values, "utf-8", "replace") if text else values


def open_for_reading(path: Path) -> h5py.File:
    """Open a file without a lock, or as another part of this process holds it open.

    HDF5 refuses to open it in two ways at once.
    """
    for locking in LOCKINGS:
        try:
            return h5py.File(path, "r", locking=locking)
        except OSError as error:
            if "flag values" not in str(error):
                raise
    raise OSError(errno.EBUSY, "another part of this process holds it open")


class Extent(NamedTuple):
    """Where a column lies: offset in the file, NumPy type, and how many values."""

    offset: int
    dtype: np.dtype[Any]
    length: int

    @property
    def hole(self) -> Hole:
        """Its first byte, and the first byte after it."""
        return self.offset, self.offset + self.dtype.itemsize * self.length


def columns_of(file: h5py.File) -> list[str]:
    """Return the names of the columns that make up a row, status last."""
    items = file.items()
    return in_order(name for name, item in items if isinstance(item, h5py.Dataset))


def in_order(names: Iterable[str]) -> list[str]:
    """Return which of the datasets of a file make up a row, status last."""
    return [*(name for name in names if name not in (TRIAL, STATUS)), STATUS]


def nominal_columns_of(file: h5py.File) -> list[str]:
    """Return the names of the columns about the nominal trial."""
    responses = sorted(read_attribute(file, "responses", ()))
    names = (*responses, STATUS, STEPS)
    return [f"{NOMINAL}/{name}" for name in names if name in file]


def extents_of(file: h5py.File) -> dict[str, Extent]:
    """Return where rows lie: columns, nominal trial, checksums, clock."""
    names = (*columns_of(file), CHECKSUM, ALONE, CLOCK, *nominal_columns_of(file))
    datasets = {name: file[name] for name in names}
    return {n: Extent(d.id.get_offset(), d.dtype, d.size) for n, d in datasets.items()}


class Rows:
    """The rows of an open, unbuffered file."""

    def __init__(self, file: BinaryIO, extents: Mapping[str, Extent]) -> None:
        self.file, self.extents = file, extents
        self.columns = [name for name in extents if "/" not in name]
        self.of_nominal = [n for n in extents if n.startswith(f"{NOMINAL}/")]

    def read(self, name: str) -> Column:
        """Return a column."""
        extent = self.extents[name]
        self.file.seek(extent.offset)
        data = read_exactly(self.file, extent.dtype.itemsize * extent.length)
        return np.frombuffer(data, extent.dtype)

    def write(self, name: str, values: Any, first: int = 0) -> None:
        """Write values of a column, from a row on."""
        extent = self.extents[name]
        data = np.ascontiguousarray(values, extent.dtype).reshape(-1)
        self.file.seek(extent.offset + first * extent.dtype.itemsize)
        write_all(self.file, data.view(np.uint8))

    def sync(self) -> None:
        """Bring everything to the disk."""
        os.fsync(self.file.fileno())


def draft_of(run: Run, path: Path) -> tuple[MemoryFile, dict[str, Extent]]:
    """Return the sealed file of a run without its rows, and where these lie.

    `path` is where the file will be.
    """
    size = sum(max(values.itemsize, 8) * run.trials for values in run.columns.values())
    draft = MemoryFile(size + METADATA)
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
        for group in file.values():
            if isinstance(group, h5py.Group):
                _name_dimensions(group, {})
        if run.study_file:  # from here: both may be moved together
            file.attrs["study_file"] = os.path.relpath(run.study_file, path.parent)
        extents = extents_of(file)
    write_seal(draft, block, [extent.hole for extent in extents.values()])
    return draft, extents


def _lay_out(file: h5py.File, run: Run) -> None:
    """Make the datasets."""
    trials = run.trials
    checks = file.create_group(CHECKS)
    checks.attrs["long_name"] = "what tells whether the file is as it was written"
    sentence = "checksum of all that is stored of a trial; 0 for none"
    allocate(file, CHECKSUM, (trials,), np.uint64, sentence)
    allocate(file, ALONE, (), np.uint64, "checksum of the nominal trial")
    sentence = "seconds the run took so far, last written at, checksum"
    allocate(file, CLOCK, (3,), np.float64, sentence)
    index = allocate(file, TRIAL, (trials,), np.int64, "number of the trial")
    index[...] = np.arange(trials)
    index.make_scale(TRIAL)
    nominal = file.create_group(NOMINAL)
    nominal.attrs["long_name"] = "the nominal trial: no deviations, not of the sample"
    columns = []
    for name, values in run.columns.items():
        dtype = encoded(values).dtype
        columns.append(allocate(file, name, (trials,), dtype))
        if name in (STATUS, STEPS):
            allocate(nominal, name, (), dtype)
    _attach(index, [*columns, file[CHECKSUM]])
    for response in run.responses:
        write_record(allocate(nominal, response.name, (), np.float64), response)
    for described in run.described:
        role = type(described).__name__.lower()
        write_attribute(column_of(file, described.name), "role", role)
    if STEPS in file:
        file[STEPS].attrs["long_name"] = "integration steps, rejected ones included"
    status = file[STATUS].attrs  # as the CF conventions have it, for xarray
    status["long_name"] = "how the trial ended"
    status["flag_values"] = np.array(list(run.words), np.uint8)
    words = [word.replace(" ", "_") for word in run.words.values()]
    status["flag_meanings"] = " ".join(words)


def _attach(index: h5py.Dataset, columns: Sequence[h5py.Dataset]) -> None:
    """Make the index the dimension scale of all columns, as the HDF5 library does.

    Its own function copies the list of columns again for each of them.
    """
    scales = np.empty(1, object)
    scales[0] = np.array([index.ref], h5py.ref_dtype)
    for column in columns:
        kind = h5py.vlen_dtype(h5py.ref_dtype)
        column.attrs.create("DIMENSION_LIST", scales, dtype=kind)
    fields = [("dataset", h5py.ref_dtype), ("dimension", np.uint32)]
    users = np.zeros(len(columns), np.dtype(fields, align=True))
    users["dataset"] = [column.ref for column in columns]
    index.attrs.create("REFERENCE_LIST", users)


def _name_dimensions(group: h5py.Group, scales: Mapping[int, h5py.Dataset]) -> None:
    """Give each list below a group a dimension, by length; readers refuse bare ones.

    It is that of the groups above if there is one.
    """
    scales, lists = dict(scales), dict[int, list[h5py.Dataset]]()
    for item in [*group.values()]:
        bare = isinstance(item, h5py.Dataset) and item.ndim == 1 and not item.is_scale
        if bare and not len(item.dims[0]):
            lists.setdefault(len(item), []).append(item)
    for length, items in lists.items():
        if length not in scales:
            name = place_name(group.name)
            name += f"_{length}" * (name in group)
            scales[length] = group.create_dataset(name, data=np.arange(length))
            scales[length].make_scale(name)
        for item in items:
            item.dims[0].attach_scale(scales[length])
    for item in group.values():
        if isinstance(item, h5py.Group):
            _name_dimensions(item, scales)


def _describe(audited: h5py.Group, run: Run) -> None:
    """Store the units of audited trials, and the reasons for choosing them."""
    for response in run.responses:
        audited["responses"][response.name].attrs["units"] = response.unit
    for chosen_by in audited.get("chosen_by", {}).values():  # as in CF
        chosen_by.attrs["flag_masks"] = np.array(
            [reason.value for reason in Reason], "u1"
        )
        names = (str(reason.name).lower() for reason in Reason)
        chosen_by.attrs["flag_meanings"] = " ".join(names)
