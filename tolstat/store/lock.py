"""A lock beside the run file, for one writer; it names the process."""

import os
import re
import socket
from contextlib import AbstractContextManager, suppress
from pathlib import Path
from typing import IO, Any

from tolstat.errors import BrokenError, RunFileError
from tolstat.operating_system import lock, open_as_it_is, process_exists
from tolstat.store.provenance import now

WORDS = "process "  # what a lock begins with


class Lock(AbstractContextManager["Lock"]):
    """The right to write a run file, until it is released or the process ends.

    The lock has the name of the run file and ends in `.lock`. RunFileError if another
    process holds it, with number, host and time; BrokenError if the folder cannot be
    written.

    Attributes
    ----------
    path : Path
        The run file.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            self._lock = _lock_of(path)
        except (OSError, RuntimeError) as error:  # links in a circle
            raise BrokenError(f"{path} cannot be written: {error}") from error
        with suppress(OSError):
            self._lock.parent.mkdir(parents=True, exist_ok=True)
        while True:
            try:
                file = open_as_it_is(self._lock)
            except OSError as error:
                raise BrokenError(f"{path} cannot be written: {error}") from error
            words = file.read()
            if words and not words.startswith(WORDS):
                file.close()
                raise RunFileError(
                    f"{self._lock} is not a lock of tolstat; rename that file, or "
                    "give the run another name"
                )
            if not lock(file):
                holder = words.strip() or "another process"
                file.close()
                raise RunFileError(
                    f"{path} is being written by {holder}; wait for it, or give "
                    "another name"
                )
            if is_still(file, self._lock):
                break
            file.close()  # its holder has just removed it
        self._file: IO[str] | None = file
        with suppress(OSError):  # a full disk: the lock holds without its words
            file.truncate(0)
            file.seek(0)
            holder = f"{os.getpid()} on {socket.gethostname()} since {now()}"
            file.write(WORDS + holder)
            file.flush()

    def __exit__(self, *_: object) -> None:
        """Release the lock."""
        if self._file:
            with suppress(OSError):
                self._lock.unlink()
            with suppress(OSError):
                self._file.close()
            self._file = None


def is_still(file: IO[Any], path: Path) -> bool:
    """Tell whether an open file is what a path names."""
    try:
        return os.path.samestat(os.fstat(file.fileno()), path.stat())
    except OSError:
        return False


def writer_of(path: Path) -> str:
    """Return the process that writes a run file; empty if none is found.

    The lock is only read, so no writer has to wait.
    """
    lock = _lock_of(path)
    try:
        words = lock.read_text().strip() if lock.is_file() else ""
    except (OSError, ValueError):
        return ""
    holder = re.match(r"process (\d+) on (.+) since ", words)
    if (
        holder
        and holder[2] == socket.gethostname()
        and not process_exists(int(holder[1]))
    ):
        return ""
    return words


def _lock_of(path: Path) -> Path:
    """Return the lock of a run file; for a link, that of its target."""
    real = path.resolve()
    return real.with_name(f"{real.name}.lock")
