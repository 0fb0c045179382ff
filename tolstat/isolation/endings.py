"""How processes end: by a signal, an exit code, or because they took too long."""

import os
from dataclasses import dataclass
from typing import Any

from tolstat.isolation.worker import OUT_OF_MEMORY
from tolstat.operating_system import signal_name

TAIL = 2000  # bytes of output


@dataclass(eq=False)
class Ended(Exception):
    """A worker has ended before it answered."""

    words: str  # how it ended, and the tail of its output
    outcomes: list[Any]  # what it evaluated before: see `WorkerProcess.outcomes`
    late: bool  # whether it was ended because it took too long
    stopped: bool  # whether it was ended because the run stops
    killed: bool  # whether anyone may have killed it, so the model may not be at fault


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
