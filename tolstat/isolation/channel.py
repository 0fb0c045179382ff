"""Messages between processes: bytes with their length before them.

They go over a socket, or into a file that outlives its writer.
"""

import os
import pickle
import socket
import struct
from collections.abc import Iterator
from typing import Any

LENGTH = struct.Struct("q")
PART = 1 << 20  # bytes that are read at once


def send(channel: socket.socket, message: bytes) -> None:
    """Send a message."""
    channel.sendall(LENGTH.pack(len(message)))
    channel.sendall(message)


def send_object(channel: socket.socket, value: Any) -> None:
    """Send an object."""
    send(channel, pickle.dumps(value, pickle.HIGHEST_PROTOCOL))


def receive(channel: socket.socket) -> bytes | None:
    """Return a message; None if the other process has closed its end."""
    try:
        head = _exactly(channel, LENGTH.size)
        return _exactly(channel, LENGTH.unpack(head)[0])
    except (EOFError, ConnectionError):
        return None


def append(file: int, message: bytes) -> None:
    """Append a message to the file of a descriptor, in one call."""
    os.write(file, LENGTH.pack(len(message)) + message)


def appended(data: bytes) -> Iterator[bytes]:
    """Yield the messages of a file; its writer may have ended within the last one."""
    first = LENGTH.size
    while first <= len(data):
        (size,) = LENGTH.unpack_from(data, first - LENGTH.size)
        if first + size > len(data):
            return
        yield data[first : first + size]
        first += size + LENGTH.size


def _exactly(channel: socket.socket, size: int) -> bytes:
    data = bytearray()
    while len(data) < size:
        part = channel.recv(min(size - len(data), PART))
        if not part:
            raise EOFError
        data += part
    return bytes(data)
