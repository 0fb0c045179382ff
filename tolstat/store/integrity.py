"""What tells whether a run file is as it was written: seal, checksums, clock.

HDF5 may end the process over a damaged file, so the seal is checked first: a digest of
all bytes that never change. It is in the user block, the part of the file before that
of HDF5. Its digest is of every byte but its own and those of the rows. A file is sealed
when it is made; while trials run only rows change. They have checksums of 64 bits, over
all that is stored of a trial.
"""

import hashlib
import io
import math
import re
import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from tolstat.arrays import Array
from tolstat.errors import DamagedError, FormatError, RunFileError
from tolstat.hdf5_heaps import HEAD, check_heaps, heaps_in
from tolstat.operating_system import local_time
from tolstat.regular_files import opened, read_exactly

FORMAT = 11
MARK = b"tolstat seal, format "
HDF5 = b"\x89HDF\r\n\x1a\n"
MOST_SEAL = 1 << 22  # bytes: of 50 000 columns
MOST_HOLES = 60_000  # reading more takes seconds
MOST_SEALED = 1 << 30  # bytes
NEAR = 1 << 16  # bytes from the beginning, in which earlier formats have their seal
UNSEALED, VERSION = 2, b"version_tolstat"  # formats 1 and 2, and an attribute of theirs
PART = 1 << 20  # bytes that are digested at once
PATTERN = re.compile(
    rb"\d+\nsize (\d{1,18})\nsha256 ([0-9a-f]{64})\nbut((?: \d{1,18}-\d{1,18})+)\n"
)
ODD = np.uint64(0x9E3779B97F4A7C15)  # 2**64 over the golden ratio
HALF = np.uint64(32)
AT_ONCE = 8192  # rows, so that the data stay in the processor's cache
EXACT = np.uint64(12)  # bits of a checksum that a float64 has no room for
LATEST = 4e9  # s since 1970 at which a run may be written
NAMED = 20  # ranges of trials that are listed

File = BinaryIO | io.RawIOBase
Hole = tuple[int, int]  # bytes that are left out: the first, the next after


def around(holes: Iterable[Hole], size: int) -> Iterator[Hole]:
    """Yield the parts of a file around its holes, in order."""
    start = 0
    for first, stop in [*sorted(holes), (size, size)]:
        if start < min(first, size):
            yield start, min(first, size)
        start = max(start, stop)


def write_all(file: BinaryIO, data: Any) -> None:
    """Write all bytes; an unbuffered file may take only a part on a full disk."""
    rest = memoryview(data).cast("B")
    while rest:
        rest = rest[file.write(rest) :]


def block_for(holes: int) -> int:
    """Return the size of the user block for so many holes: a power of 2."""
    return 1 << (160 + 40 * holes).bit_length()


def write_seal(file: File, block: int, rows: list[Hole]) -> None:
    """Seal a file, as the last step of writing it; rows may still change."""
    holes = sorted([(0, block), *rows])
    but = "".join(f" {first}-{stop}" for first, stop in holes)
    head = f"{FORMAT}\nsize {file.seek(0, 2)}\nsha256 ".encode()
    text = MARK + head + _digest_of(file, holes) + f"\nbut{but}\n".encode()
    assert len(text) <= block
    file.seek(0)
    file.write(text.ljust(block, b"\0"))


def _digest_of(file: File, holes: list[Hole]) -> bytes:
    """Digest all of a file but its holes."""
    digest = hashlib.sha256()
    for first, stop in around(holes, file.seek(0, 2)):
        for start in range(first, stop, PART):
            digest.update(_read(file, start, min(stop, start + PART)))
    return digest.hexdigest().encode()


def _format_of(file: File) -> int:
    """Return the format of a run, damaged or not; 0 if a file is not a run."""
    file.seek(0)
    head = file.read(NEAR) or b""
    seal = re.search(MARK + rb"(\d{1,9})\n", head)
    if seal and (seal.start() == 0 or head.startswith(HDF5)):
        return int(seal[1])
    return UNSEALED if head.startswith(HDF5) and VERSION in head else 0


def is_run(path: Path) -> bool:
    """Tell whether a file is a run, damaged or not."""
    try:
        with opened(path) as file:
            return _format_of(file) > 0
    except OSError:  # not ours to read, nor to replace
        return False


def check_seal(path: Path) -> list[Hole]:
    """Refuse a file that is no run, has another format, or is damaged.

    Returns what the seal leaves out.
    """
    try:
        with opened(path) as file:
            return _check(file, path)
    except OSError as error:
        raise RunFileError(f"{path} cannot be read: {error.strerror}") from error


def _check(file: File, path: Path) -> list[Hole]:
    number = _format_of(file)
    if not number:
        file.seek(0)
        hdf5 = file.read(len(HDF5)) == HDF5
        kind = "is an HDF5 file, but" if hdf5 else "cannot be read as HDF5: it is"
        raise RunFileError(f"{path} {kind} not a run of tolstat; run its study again")
    if number != FORMAT:
        words = "1 or 2" if number == UNSEALED else number
        raise FormatError(
            f"{path} has format {words}, this tolstat reads format {FORMAT}; open it "
            "with the tolstat that made it, or run its study again"
        )
    file.seek(len(MARK))
    seal = PATTERN.match(file.read(MOST_SEAL) or b"")
    if seal and seal[3].count(b"-") > MOST_HOLES:
        raise RunFileError(
            f"{path} is not a run: it has more than {MOST_HOLES} columns"
        )
    size = file.seek(0, 2)
    sealed = int(seal[1]) if seal else size
    if seal is None or sealed != size or _digest_of(file, _holes(seal[3])) != seal[2]:
        short = f": {size} bytes of {sealed} are there" if size < sealed else ""
        raise DamagedError(
            f"{path} is damaged outside its trials{short}, or was changed by "
            "another program; nothing in it can be trusted: run its study again"
        )
    holes = _holes(seal[3])
    try:
        parts = [*around(holes, size)]
        if sum(stop - first for first, stop in parts) > MOST_SEALED:
            raise ValueError("it holds too much beside its trials")
        check_heaps([_read(file, *part) for part in parts], size)
        _check_holes(file, parts, size)
    except ValueError as error:
        raise RunFileError(f"{path} is not a run: {error}") from None
    return holes


def _read(file: File, first: int, stop: int) -> bytearray:
    file.seek(first)
    return read_exactly(file, stop - first)


def _check_holes(file: File, parts: Sequence[Hole], size: int) -> None:
    """Refuse a heap outside the sealed parts of a file; ValueError."""
    before = 0
    for stop, after in [*parts, (size, size)]:
        for start in range(before, stop, PART):
            end = min(stop, start + PART) + HEAD
            if any(heaps_in(_read(file, max(0, start - HEAD), min(end, size)), size)):
                raise ValueError("texts lie where its trials do")
        before = after


def _holes(text: bytes) -> list[Hole]:
    pairs = re.findall(rb"(\d+)-(\d+)", text)
    return [(int(first), int(stop)) for first, stop in pairs]


def fingerprints(columns: Sequence[NDArray[Any]], first: int = 0) -> NDArray[np.uint64]:
    """Return a checksum of all that is stored of each trial, uint64[trial].

    Every step maps 64 bits one to one, so a change of one value always changes the
    checksum. It includes the number of the trial, so swapped rows are found too.
    Columns are numbers or fixed-length texts. A checksum is never 0, which stands for
    a trial without one.
    """
    rows = len(columns[0])
    words = [word for column in columns for word in _words(column)]
    checksums = np.empty(rows, np.uint64)
    for start in range(0, rows, AT_ONCE):
        part = slice(start, min(start + AT_ONCE, rows))
        mixed = np.arange(first + part.start, first + part.stop, dtype=np.uint64) * ODD
        for word in words:
            mixed = (mixed ^ word[part].astype(np.uint64)) * ODD
            mixed ^= mixed >> HALF
        checksums[part] = np.where(mixed == 0, ODD, mixed)
    return checksums


def _words(column: NDArray[Any]) -> list[NDArray[Any]]:
    """Return a column as unsigned integers; a text as several."""
    column = np.ascontiguousarray(column)
    if column.dtype.kind == "S":
        return list(column.view(np.uint8).reshape(len(column), -1).T)
    return [column.view(f"u{column.dtype.itemsize}")]


def clock_of(seconds: float) -> Array:
    """Return the clock of a run that took so many seconds until now: float64[3]."""
    return _checked(seconds, time.time())


def times_of(clock: NDArray[Any]) -> dict[str, Any]:
    """Return "ended_at", when a run was last written, and "seconds", how long it took.

    Where the clock is empty or damaged, they are empty and NaN.
    """
    if not is_whole(clock):
        return {"ended_at": "", "seconds": math.nan}
    if not 0 <= clock[1] < LATEST:
        raise ValueError("its clock is wrong")
    return {"ended_at": local_time(clock[1]), "seconds": float(clock[0])}


def is_whole(clock: NDArray[Any]) -> bool:
    """Return whether a clock is undamaged."""
    return clock.tobytes() == _checked(clock[0], clock[1]).tobytes()


def _checked(seconds: float, written: float) -> Array:
    checksum = fingerprints([np.array([seconds]), np.array([written])])[0]
    return np.array([seconds, written, float(checksum >> EXACT)])


@dataclass(frozen=True)
class Damage:
    """Parts of a run that have changed since they were written."""

    # int64[n]: Numbers of the trials, ascending
    trials: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, np.int64))
    nominal: bool = False  # whether the nominal trial is damaged
    clock: bool = False  # whether the duration of the run is

    def __bool__(self) -> bool:
        """Return whether there is any damage."""
        return bool(len(self.trials)) or self.nominal or self.clock

    @property
    def words(self) -> str:
        """What is damaged, every trial by its number."""
        parts = [f"trials {ranges_of(self.trials)}"] if len(self.trials) else []
        parts += ["the nominal trial"] if self.nominal else []
        parts += ["the duration of the run"] if self.clock else []
        return ", ".join(parts)


def ranges_of(trials: Iterable[int]) -> str:
    """Return numbers of trials as text: "3, 17-20"."""
    ranges: list[list[int]] = []
    for trial in map(int, trials):
        if ranges and trial == ranges[-1][1] + 1:
            ranges[-1][1] = trial
        else:
            ranges.append([trial, trial])
    words = [f"{a}" if a == b else f"{a}-{b}" for a, b in ranges[:NAMED]]
    if len(ranges) > NAMED:
        words.append(f"and {len(ranges) - NAMED} more ranges")
    return ", ".join(words)
