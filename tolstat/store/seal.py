"""The seal of a run file: what of it never changes is known to be whole.

HDF5 may end the process over a damaged file, so it never sees one: a dataset among the
first of the file, found without HDF5, holds a digest of every byte but those of the
rows, which have checksums of their own. A file is sealed when it is made; while trials
run only rows change.
"""

from __future__ import annotations

import hashlib
import io
import re
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, NamedTuple

from tolstat.errors import DamagedError, FormatError, RunFileError

FORMAT = 4
MARK = b"tolstat seal, format "
NEAR = 1 << 16  # bytes from the beginning of a file, in which its seal begins
AT_ONCE = 1 << 20
DIGITS = 64
PATTERN = re.compile(
    rb"(\d{1,9})\nsize (\d{1,18})\nsha256 ([0-9a-f]{64})\n"
    rb"rows((?: \d{1,18} \d{1,18})*) *\n"
)

File = BinaryIO | io.RawIOBase
Hole = tuple[int, int]  # where it begins, and how many bytes it has


class Seal(NamedTuple):
    """What a file says it is."""

    format: int  # how it is laid out
    size: int  # bytes of the file
    digest: str  # of all that is in no hole
    rows: tuple[Hole, ...]  # holes: where the rows lie, ascending
    place: int  # where the digest stands: a hole too


def text_of(size: int, rows: list[Hole], digest: str = "0" * DIGITS) -> bytes:
    """Write a seal, of the same length for any digest and nearly any size."""
    holes = "".join(f" {first} {length}" for first, length in sorted(rows))
    return MARK + f"{FORMAT}\nsize {size}\nsha256 {digest}\nrows{holes}".encode()


def length_of(columns: int) -> int:
    """Say how many bytes the seal of a file takes that has so many columns."""
    return 160 + 32 * columns


def write_seal(file: File, place: int, length: int, rows: list[Hole]) -> None:
    """Seal a file, the last that is written to it; rows may still change."""
    size = file.seek(0, 2)
    empty = text_of(size, rows)
    _put(file, place, length, empty)
    digest_at = place + empty.index(b"0" * DIGITS)
    seal = Seal(FORMAT, size, "", tuple(sorted(rows)), digest_at)
    _put(file, place, length, text_of(size, rows, digest_of(file, seal)))


def _put(file: File, place: int, length: int, text: bytes) -> None:
    assert len(text) < length
    file.seek(place)
    file.write(text.ljust(length - 1) + b"\n")


def read_seal(file: File) -> Seal | None:
    """Read the seal of a file; None if it has none.

    A title or a comment of the study may read like one: the seal is what fits.
    """
    found = [*_seals(file)]
    whole = [each for each in found if len(found) > 1 and fits(file, each)]
    complete = [each for each in found if each.digest]
    return next(iter([*whole, *complete, *found]), None)


def _seals(file: File) -> Iterator[Seal]:
    """Yield whatever reads like a seal."""
    file.seek(0)
    head = file.read(NEAR)
    for mark in re.finditer(MARK, head):
        begin = mark.end()
        number = re.match(rb"\d{1,9}\n", head[begin : begin + 10])
        file.seek(begin)
        if found := PATTERN.match(file.read(NEAR * 16)):
            holes = [int(each) for each in found[4].split()]
            rows = tuple(zip(holes[::2], holes[1::2], strict=True))
            place, digest = begin + found.start(3), found[3].decode()
            yield Seal(int(found[1]), int(found[2]), digest, rows, place)
        else:
            yield Seal(int(number[0]) if number else FORMAT, 0, "", (), 0)


def fits(file: File, seal: Seal) -> bool:
    """Tell whether a seal is that of the file, and the file whole."""
    return seal.size == file.seek(0, 2) and digest_of(file, seal) == seal.digest


def digest_of(file: File, seal: Seal) -> str:
    """Digest all of a file but its holes."""
    digest, at = hashlib.sha256(), 0
    for first, length in sorted([*seal.rows, (seal.place, DIGITS)]):
        for some in _read(file, at, first):
            digest.update(some)
        at = max(at, first + length)
    for some in _read(file, at, file.seek(0, 2)):
        digest.update(some)
    return digest.hexdigest()


def _read(file: File, first: int, stop: int) -> Iterator[bytes]:
    file.seek(first)
    while first < stop and (some := file.read(min(stop - first, AT_ONCE))):
        yield some
        first += len(some)


def is_run(path: Path) -> bool:
    """Tell whether a file is a run, damaged or not."""
    try:
        with path.open("rb") as file:
            seal = read_seal(file)
            return seal is not None and bool(seal.digest or _begins_as_hdf5(file))
    except OSError:  # not ours to read, nor to replace
        return False


def check_seal(path: Path) -> None:
    """Refuse a file that HDF5 must not see: no run, of another format, or damaged."""
    try:
        with path.open("rb") as file:
            seal = read_seal(file)
            hdf5 = _begins_as_hdf5(file)
            size = file.seek(0, 2)
            whole = seal and fits(file, seal)
    except OSError as error:
        raise RunFileError(f"{path} cannot be read: {error.strerror}") from error
    if seal is None:
        what = (
            "is an HDF5 file, but not" if hdf5 else "cannot be read as HDF5: it is not"
        )
        raise RunFileError(
            f"{path} {what} a run of tolstat, or one made before format {FORMAT}: run "
            "its study again"
        )
    if seal.format != FORMAT:
        raise FormatError(
            f"{path} has format {seal.format}, this tolstat reads format {FORMAT}; "
            "open it with the tolstat of its time, or run its study again"
        )
    if not whole:
        short = f": {size} bytes of {seal.size} are there" if size < seal.size else ""
        raise DamagedError(
            f"{path} is damaged in what all of it depends on{short}, or was changed by "
            "another program; nothing in it can be trusted: run its study again"
        )


def _begins_as_hdf5(file: File) -> bool:
    file.seek(0)
    return file.read(8) == b"\x89HDF\r\n\x1a\n"
