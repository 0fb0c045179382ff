"""A file in memory for HDF5, which ends the process if a disk is full."""

import io
from collections.abc import Iterable, Iterator
from typing import Any, BinaryIO

import numpy as np

ROOM = 1 << 16  # bytes at first; it doubles when they are used up
Hole = tuple[int, int]  # bytes that are left out: the first, the next after


class MemoryFile(io.RawIOBase):
    """A file for h5py; bytes that were never written are zero.

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
