"""The seal of a run file: a digest of all bytes that never change.

HDF5 may end the process over a damaged file, so the seal is checked first. It is in
the user block, the part of the file before that of HDF5. Its digest is of every byte
but its own and those of the rows, which have other checksums. A file is sealed when it
is made; while trials run only rows change.
"""

import hashlib
import io
import re
from pathlib import Path
from typing import BinaryIO

from tolstat.errors import DamagedError, FormatError, RunFileError
from tolstat.store.memory_file import Hole, around

FORMAT = 7
MARK = b"tolstat seal, format "
HDF5 = b"\x89HDF\r\n\x1a\n"
NEAR = 1 << 16  # bytes from the beginning, in which earlier formats have their seal
UNSEALED, VERSION = 2, b"version_tolstat"  # formats 1 and 2, and an attribute of theirs
AT_ONCE = 1 << 20
PATTERN = re.compile(
    rb"\d+\nsize (\d{1,18})\nsha256 ([0-9a-f]{64})\nbut((?: \d{1,18}-\d{1,18})+)\n"
)

File = BinaryIO | io.RawIOBase


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
        for start in range(first, stop, AT_ONCE):
            file.seek(start)
            digest.update(file.read(min(stop - start, AT_ONCE)) or b"")
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
        with path.open("rb") as file:
            return _format_of(file) > 0
    except OSError:  # not ours to read, nor to replace
        return False


def check_seal(path: Path) -> None:
    """Refuse a file that is no run, has another format, or is damaged."""
    try:
        with path.open("rb") as file:
            _check(file, path)
    except OSError as error:
        raise RunFileError(f"{path} cannot be read: {error.strerror}") from error


def _check(file: File, path: Path) -> None:
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
            "with the tolstat that made it, or run its study again",
        )
    file.seek(len(MARK))
    seal = PATTERN.match(b"".join(file.readline() for _ in range(4)))
    size = file.seek(0, 2)
    sealed = int(seal[1]) if seal else size
    if seal is None or sealed != size or _digest_of(file, _holes(seal[3])) != seal[2]:
        short = f": {size} bytes of {sealed} are there" if size < sealed else ""
        raise DamagedError(
            f"{path} is damaged outside its trials{short}, or was changed by "
            "another program; nothing in it can be trusted: run its study again"
        )


def _holes(text: bytes) -> list[Hole]:
    pairs = re.findall(rb"(\d+)-(\d+)", text)
    return [(int(first), int(stop)) for first, stop in pairs]
