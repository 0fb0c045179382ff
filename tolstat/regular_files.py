"""Files opened for reading: regular ones, read with a bound and not by half."""

import errno
import io
import os
from pathlib import Path
from typing import BinaryIO

from tolstat.operating_system import open_regular

MEGABYTE = 1_000_000


def opened(path: Path) -> BinaryIO:
    """Open a file for reading; a folder, a pipe or another device is an OSError."""
    return open_regular(path, os.O_RDONLY)


def opened_for_writing(path: Path) -> BinaryIO:
    """Open or create a file; a link is not followed, and no pipe waited for."""
    return open_regular(path, os.O_RDWR | os.O_CREAT)


def created(path: Path, mode: int) -> BinaryIO:
    """Create a file that does not exist, with these permissions but the umask's."""
    return open_regular(path, os.O_RDWR | os.O_CREAT | os.O_EXCL, mode)


def read_exactly(file: BinaryIO | io.RawIOBase, size: int) -> bytearray:
    """Return the next bytes of a file; OSError if there are fewer."""
    data, done = bytearray(size), 0
    while done < size:  # an unbuffered file may read a part
        count = file.readinto(memoryview(data)[done:])  # type: ignore[union-attr]
        if not count:
            raise OSError(errno.EIO, f"{done} of {size} bytes were read")
        done += count
    return data


def content(path: Path, megabytes: int) -> bytes:
    """Return the content of a file; OSError if it is larger, or is no file."""
    with opened(path) as file:
        size = os.fstat(file.fileno()).st_size
        if size > megabytes * MEGABYTE:
            words = f"larger than {megabytes} MB, the most allowed"
            raise OSError(errno.EFBIG, words, str(path))
        return bytes(read_exactly(file, size))
