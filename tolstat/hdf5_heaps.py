"""Global heaps of HDF5 files, in which texts lie: damaged ones hang the library."""

import re

HEAP = re.compile(rb"GCOL\x01\x00\x00\x00")
HEAD = 16  # bytes of a heap, and of an object in it


def heaps_end(data: bytes | bytearray) -> bool:
    """Return whether all heaps in some bytes of a file can be read to their end.

    The library follows the sizes of objects without a look: one of free space of no
    size is followed for ever, deaf to signals.
    """
    return all(_ends(data, heap.start()) for heap in HEAP.finditer(data))


def _ends(data: bytes | bytearray, heap: int) -> bool:
    place, stop = heap + HEAD, heap + _number(data, heap + 8)
    while place + HEAD <= min(stop, len(data)):
        index, size = data[place] + data[place + 1], _number(data, place + 8)
        step = HEAD + -(-size // 8) * 8 if index else size
        if step < HEAD or place + step > stop:
            return False
        place += step
    return True


def _number(data: bytes | bytearray, place: int) -> int:
    return int.from_bytes(data[place : place + 8], "little")
