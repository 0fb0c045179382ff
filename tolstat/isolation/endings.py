"""How processes end: by a signal, an exit code, or because they took too long."""

import os
from typing import Any

from tolstat.isolation.worker import OUT_OF_MEMORY
from tolstat.operating_system import signal_name

TAIL = 2000  # bytes of output


class Ended(Exception):
    """A worker has ended before it answered.

    Attributes
    ----------
    row : int
        The row that was under way.
    late : bool
        Whether it was ended because it took too long.
    killed : bool
        Whether anyone may have killed it: the model is not at fault for sure.
    words : str
        How it ended, and the tail of its output.
    """

    def __init__(self, row: int, words: str, *, late: bool, killed: bool) -> None:
        super().__init__(words)
        self.row, self.words, self.late, self.killed = row, words, late, killed


def how_it_ended(status: int) -> str:
    """Return how a process has ended, by its exit code or minus its signal."""
    if status == OUT_OF_MEMORY:
        return "out of memory"
    if status < 0:
        return f"ended by {signal_name(-status)}"
    return f"ended with exit code {status}"


def with_tail(words: str, log: Any) -> str:
    """Return words with the end of a file of output below them, if there is any."""
    size = log.seek(0, os.SEEK_END)
    log.seek(max(0, size - TAIL))
    output = log.read(TAIL).decode("utf-8", "replace").strip()
    return f"{words}\n{output}" if output else words
