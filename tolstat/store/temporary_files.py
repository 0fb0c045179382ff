"""Files beside a run: written aside and renamed, moved aside, rescued; their room."""

from __future__ import annotations

import math
import os
import re
import shutil
import tempfile
from contextlib import suppress
from itertools import count
from pathlib import Path
from typing import BinaryIO

from tolstat.errors import Advice, BrokenError, RunFileError, TolstatError
from tolstat.store.lock import Lock, alive
from tolstat.store.open_run import open as open_run
from tolstat.store.seal import is_run

_numbers = count()


def aside_of(path: Path) -> Path:
    """Name a file beside a path, of this process alone; remove those of dead ones."""
    ours = re.compile(re.escape(path.name) + r"\.([0-9]{1,9})-[0-9]+\.part")
    for left in path.parent.iterdir():
        found = ours.fullmatch(left.name)
        if found and not alive(int(found[1])):
            with suppress(OSError):
                left.unlink()
    return path.with_name(f"{path.name}.{os.getpid()}-{next(_numbers)}.part")


def free_name(path: Path, word: str, folder: Path | None = None) -> Path:
    """Name a file that is not there yet: run.h5 becomes run.WORD.h5, run.WORD-2.h5."""
    folder = folder or path.parent
    for number in count(1):
        ending = f"-{number}" if number > 1 else ""
        found = folder / f"{path.stem}.{word}{ending}{path.suffix}"
        if not os.path.lexists(found):
            break
    return found


def check_replaceable(path: Path, *, force: bool) -> None:
    """Refuse to write over what exists, unless that is a run."""
    if not os.path.lexists(path):
        return
    if not path.is_file() or not is_run(path):
        raise RunFileError(f"{path} exists and is no run; it is not replaced")
    if not force:
        raise RunFileError(
            f"{path} exists already, and is replaced only by force",
            *_next(path),
        )


def _next(path: Path) -> tuple[Advice, ...]:
    """Return what can be done about a run that is there."""
    replace = Advice("replace", path)
    with suppress(TolstatError):  # of another format, or too damaged to be read
        run = open_run(path, damaged=True)
        if run.damage or not run.complete:
            return replace, Advice("resume", path, run.machine)
    return (replace,)


def check_room(path: Path, size: int) -> None:
    """Refuse to begin a file that cannot be finished: its end is written beside it."""
    try:
        free = shutil.disk_usage(path.parent).free
    except OSError as error:
        raise BrokenError(f"{path} cannot be written: {error}") from error
    most = math.inf
    with suppress(ImportError):  # not on every system
        import resource

        limit, _ = resource.getrlimit(resource.RLIMIT_FSIZE)
        most = math.inf if limit == resource.RLIM_INFINITY else limit
    if size > most:
        raise BrokenError(
            f"{path}: the run needs a file of {size / 1e6:.1f} MB, and "
            f"{most / 1e6:.1f} MB are allowed (ulimit -f)"
        )
    if 2 * size > free:
        raise BrokenError(
            f"{path}: the run needs {2 * size / 1e6:.1f} MB, its file and a copy "
            f"while its end is written, and {free / 1e6:.1f} MB are free; make room, "
            "or write it to another disk"
        )


def rescued(file: BinaryIO, path: Path) -> tuple[Lock, BinaryIO]:
    """Copy an open file to a name that is free, beside where it was if that can be."""
    for folder in (path.parent, Path.cwd(), Path(tempfile.gettempdir())):
        with suppress(OSError, BrokenError):
            lock = Lock(free_name(path, "rescued", folder))
            try:
                with lock.path.open("xb") as copy:
                    file.seek(0)
                    shutil.copyfileobj(file, copy)
                return lock, lock.path.open("r+b", buffering=0)
            except OSError:
                lock.path.unlink(missing_ok=True)
                lock.__exit__()
                raise
    raise OSError("it was removed or moved, and no copy of it can be written")
