"""A file in memory, for what HDF5 writes: it ends the process where a disk is full."""

from __future__ import annotations

import io
from typing import Any, BinaryIO

PAGE = 4096


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


def write_all(file: BinaryIO, data: Any) -> None:
    """Write all of it: an unbuffered file may take a part where the disk gets full."""
    left = memoryview(data).cast("B")
    while left:
        left = left[file.write(left) :]
