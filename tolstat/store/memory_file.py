"""A file in memory for HDF5, which ends the process if a disk is full."""

import io
from collections.abc import Iterator
from typing import Any, BinaryIO

PAGE = 4096
NOTHING = bytes(PAGE)


class MemoryFile(io.RawIOBase):
    """A file for h5py, kept in pages; bytes that were never written are zero."""

    def __init__(self) -> None:
        self._pages: dict[int, bytearray] = {}
        self._at = self.size = 0

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        """Go to a place."""
        start = {io.SEEK_SET: 0, io.SEEK_CUR: self._at, io.SEEK_END: self.size}
        self._at = start[whence] + offset
        return self._at

    def truncate(self, size: int | None = None) -> int:
        """Set the size; no page is freed."""
        self.size = self._at if size is None else size
        return self.size

    def write(self, data: Any) -> int:
        """Write at the place."""
        given = memoryview(data).cast("B")
        for number, within, part in self._pieces(len(given)):
            page = self._pages.setdefault(number, bytearray(PAGE))
            page[within] = given[part]
        self.size = max(self.size, self._at)
        return len(given)

    def readinto(self, buffer: Any) -> int:
        """Read from the place."""
        wanted = memoryview(buffer).cast("B")
        there = min(len(wanted), max(self.size - self._at, 0))
        for number, within, part in self._pieces(there):
            wanted[part] = self._pages.get(number, NOTHING)[within]
        return there

    def _pieces(self, count: int) -> Iterator[tuple[int, slice, slice]]:
        """Yield the pages of so many bytes: number, part of the page, part of them."""
        done = 0
        while done < count:
            number, first = divmod(self._at, PAGE)
            length = min(PAGE - first, count - done)
            yield number, slice(first, first + length), slice(done, done + length)
            self._at, done = self._at + length, done + length

    def copy_to(self, file: BinaryIO) -> None:
        """Write what there is to another file, and give it this size."""
        for number, page in sorted(self._pages.items()):
            file.seek(number * PAGE)
            write_all(file, page[: self.size - number * PAGE])
        file.truncate(self.size)


def write_all(file: BinaryIO, data: Any) -> None:
    """Write all bytes; an unbuffered file may take only a part on a full disk."""
    left = memoryview(data).cast("B")
    while left:
        left = left[file.write(left) :]
