"""Start of the command line, and its end by Ctrl-C: finished work is stored."""

import gc
import os
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from threading import Event, Thread
from types import FrameType
from typing import Any, NoReturn

from tolstat.operating_system import STOP_SIGNALS, limit_blas, wait_for_readers

INTERRUPTED = 130
PATIENCE = 1.5  # s, from a first Ctrl-C on; Ctrl-C ends within two seconds
ENDING = 8.0  # s, more for work that has looked and comes to its end: a busy machine
NOTHING_WRITTEN = "stopped: nothing is written"
LIMITS_NOT_MET, LIMITS_UNDECIDED = 3, 4

Handler = Callable[[int, FrameType | None], object]


def entry() -> None:
    """Run the command line; the entry point of the package."""
    on_interrupt(leave)
    wait_for_readers()
    # workers and answers have threads already: those of BLAS would wait, and busily
    limit_blas()
    os.environ.pop("HDF5_DRIVER", None)  # HDF5 ends the process at one unknown to it
    gc.set_threshold(100_000, 50, 100)  # answers are many small objects without cycles
    # only now: loading click takes as long as Python itself
    import warnings

    from tolstat.cli.main import main, note

    warnings.showwarning = note  # type: ignore[assignment]
    try:
        main()
    except SystemExit as end:
        if end.code == INTERRUPTED:
            leave_interrupted()
        raise


def leave(number: int, frame: FrameType | None) -> NoReturn:
    """End the process, even while threads compute."""
    _leave_saying(NOTHING_WRITTEN)


def _leave_saying(words: str) -> NoReturn:
    with suppress(OSError):  # the terminal may be gone
        sys.stderr.write(f"{words}\n")
        sys.stderr.flush()
    os._exit(INTERRUPTED)


def leave_interrupted() -> NoReturn:
    """End the process at once, beside threads that compile, or draft a file.

    `sys.exit` would wait for some; others would go on in a Python that is taken down.
    """
    with suppress(OSError):
        sys.stdout.flush()
        sys.stderr.flush()
    os._exit(INTERRUPTED)


def on_interrupt(handler: Handler) -> dict[signal.Signals, Any]:
    """Let a function handle Ctrl-C and similar signals; return the earlier handlers.

    Ignored signals stay ignored: `nohup`, background jobs.
    """
    before: dict[signal.Signals, Any] = {}
    for number in STOP_SIGNALS:
        if (handled_by := signal.getsignal(number)) is not signal.SIG_IGN:
            before[number] = handled_by
            signal.signal(number, handler)
    return before


class Stop(Event):
    """Set by a first Ctrl-C; it knows whether the work has looked since."""

    seen = False

    def is_set(self) -> bool:
        """Return whether it is set."""
        self.seen |= super().is_set()
        return super().is_set()


@contextmanager
def stop_on_interrupt(words: str = NOTHING_WRITTEN) -> Iterator[Stop]:
    """Let the first Ctrl-C set the event; a second one ends the process at once.

    Work that does not look at the event is left after `PATIENCE`, with the words: files
    are whole at any moment, as `kill -9` needs it.
    """
    stop, ended = Stop(), Event()

    def interrupt(number: int, frame: FrameType | None) -> None:
        if stop.is_set():
            os._exit(INTERRUPTED)
        stop.set()

    def watch() -> None:
        stop.wait()
        if not (ended.wait(PATIENCE) or (stop.seen and ended.wait(ENDING))):
            _leave_saying(words)

    before = on_interrupt(interrupt)
    # started now: a handler of signals must wait for no lock, as of a new thread
    Thread(target=watch, daemon=True).start()
    try:
        yield stop
    finally:
        ended.set()
        stop.set()  # ends the thread
        for number, handler in before.items():
            signal.signal(number, handler)
