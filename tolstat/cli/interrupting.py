"""Ctrl-C, and what ends a session or a job: what is done is kept."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from threading import Event
from types import FrameType
from typing import Any

INTERRUPTED = 130
LIMITS_NOT_MET = 3
SIGNALS = ("SIGINT", "SIGTERM", "SIGHUP")  # not every system has the last

Handler = Callable[[int, FrameType | None], object]


def leave(number: int, frame: FrameType | None) -> None:
    """End the process, whatever its threads still compute."""
    with suppress(OSError):  # the terminal may be gone
        sys.stderr.write("stopped: nothing is written\n")
        sys.stderr.flush()
    os._exit(INTERRUPTED)


def on_interrupt(handler: Handler) -> dict[signal.Signals, Any]:
    """Let a function handle Ctrl-C and its like; return what did before.

    What is ignored stays so: `nohup`, jobs in the background.
    """
    before: dict[signal.Signals, Any] = {}
    for name in SIGNALS:
        number = getattr(signal, name, None)
        if number and (known := signal.getsignal(number)) is not signal.SIG_IGN:
            before[number] = known
            signal.signal(number, handler)
    return before


@contextmanager
def stop_on_interrupt() -> Iterator[Event]:
    """Let the first Ctrl-C set an event; a second one ends the process at once.

    Yields
    ------
    Event
        Set once the user wants to stop.
    """
    stop = Event()

    def interrupt(number: int, frame: FrameType | None) -> None:
        if stop.is_set():
            os._exit(INTERRUPTED)
        stop.set()

    before = on_interrupt(interrupt)
    try:
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
