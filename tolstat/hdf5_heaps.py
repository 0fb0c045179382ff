"""Global heaps of HDF5 files, in which texts lie, looked at before the library does.

It follows the sizes of objects without a look: one of no size for ever, deaf to stops.
And it reads an object as often as something refers to it: gigabytes of a file of one
megabyte.
"""

import re
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Data = bytes | bytearray

HEAP = re.compile(rb"GCOL\x01")  # what the library looks at
HEAD = 16  # bytes of a heap, and of an object in it
LONG = 256  # bytes of a text; those of shorter ones are borne by what refers to them
MOST_OBJECTS = 1 << 16  # in a heap


def longest_object(data: Data) -> int:
    """Return the size of the longest object in the heaps of a file, bytes.

    ValueError if a heap has no end in it.
    """
    return max((size for size, _ in _objects_in(data, len(data))), default=0)


def check_heaps(parts: Sequence[Data], size: int) -> None:
    """Refuse heaps without an end, and texts longer than all parts; ValueError.

    The parts are of a file of some size.
    """
    objects = {item for part in parts for item in _objects_in(part, size)}
    long = [length << 16 | number for length, number in objects if length >= LONG]
    if not long:
        return
    keys = np.sort(np.array(long, np.uint64))
    if sum(_referred(part, keys) for part in parts) > sum(map(len, parts)):
        raise ValueError("its texts are longer than the file")


def check_sizes(file: Any) -> None:
    """Refuse an h5py.File whose sizes have other than eight bytes; ValueError."""
    if file.id.get_create_plist().get_sizes() != (8, 8):
        raise ValueError("its sizes have other than 8 bytes")


def heaps_in(data: Data, size: int) -> Iterator[tuple[int, int]]:
    """Yield first and last place of what may be a heap in a file of some size.

    The library reads none that is longer.
    """
    for heap in HEAP.finditer(data):
        length = _number(data, heap.start() + 8, 8)
        if HEAD <= length <= size:
            yield heap.start(), heap.start() + length


def _referred(data: Data, keys: NDArray[np.uint64]) -> int:
    """Return the size of all that is referred to: by a size, an address, a number.

    Wherever that stands; the library refuses another size than that of the object.
    """
    total, longest = 0, int(keys[-1]) >> 16
    for shift in range(4):
        words = np.frombuffer(data, "<u4", max(0, len(data) - shift) // 4, shift)
        sizes, numbers = words[:-3], words[3:]
        likely = (sizes >= LONG) & (sizes <= longest) & (numbers < MOST_OBJECTS)
        sizes, numbers = sizes[likely].astype(np.uint64), numbers[likely]
        exist = np.isin(sizes << np.uint64(16) | numbers, keys)
        total += int(sizes[exist].sum())
    return total


def _objects_in(data: Data, size: int) -> Iterator[tuple[int, int]]:
    """Yield size and number of each object in the heaps of some bytes of a file."""
    last = 0
    for start, stop in heaps_in(data, size):
        if start < last:
            raise ValueError("heaps of its texts lie over each other")
        place, last = start + HEAD, stop
        while place + HEAD <= stop:
            number, length = _number(data, place, 2), _number(data, place + 8, 8)
            step = HEAD + -(-length // 8) * 8 if number else length
            if step < HEAD or place + step > min(stop, len(data)):
                raise ValueError("a heap of its texts has no end")
            if number:
                yield length, number
            place += step


def _number(data: Data, place: int, size: int) -> int:
    return int.from_bytes(data[place : place + size], "little")
