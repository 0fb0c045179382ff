"""Files beside a run: their names, what they may replace, and their room."""

import hashlib
import os
import re
import shutil
from contextlib import suppress
from itertools import count
from pathlib import Path
from typing import NamedTuple

from tolstat.errors import Advice, BrokenError, Remedy, RunFileError, TolstatError
from tolstat.operating_system import (
    give_second_name,
    largest_file,
    process_exists,
)
from tolstat.store.open_run import open as open_run
from tolstat.store.seal import is_run

_numbers = count()


def aside_of(path: Path) -> Path:
    """Return a temporary name beside a path; remove files of dead processes."""
    names = re.compile(re.escape(path.name) + r"\.([0-9]{1,9})-[0-9]+\.part")
    for file in path.parent.iterdir():
        name = names.fullmatch(file.name)
        if name and not process_exists(int(name[1])):
            with suppress(OSError):
                file.unlink()
    return path.with_name(f"{path.name}.{os.getpid()}-{next(_numbers)}.part")


def free_name(path: Path, word: str) -> Path:
    """Return a name that is free: run.h5 becomes run.WORD.h5, run.WORD-2.h5."""
    words = (f"{word}-{number}" if number > 1 else word for number in count(1))
    names = (path.with_name(f"{path.stem}.{word}{path.suffix}") for word in words)
    return next(name for name in names if not os.path.lexists(name))


def before_of(path: Path) -> Path:
    """Return the name under which a run is kept while a new one replaces it."""
    target = path.resolve()  # a link stays a link
    return target.with_name(f"{target.name}.before")


def identity(path: Path) -> str:
    """Return what identifies a run file: a digest of its beginning, where its seal is.

    Empty if there is no file.
    """
    with suppress(OSError), path.open("rb") as file:
        return hashlib.sha256(file.read(4096)).hexdigest()[:16]
    return ""


class Before(NamedTuple):
    """What lies, or is to lie, at RUN.h5.before while a new run replaces one."""

    path: Path
    identity: str
    is_next: bool  # whether it is the run that is replaced now, and is not there yet


def run_before(path: Path) -> Before:
    """Return which run is kept as RUN.h5.before when a new one takes its place.

    Where an interrupted run is replaced that had itself replaced one, that one is kept
    on: it came to its end.

    Raises
    ------
    RunFileError
        If another file of this name is there, which is not removed.
    """
    before = before_of(path)
    if identified := identity(before):
        if before.samefile(path):  # of a replacement that was killed
            return Before(before, identified, False)
        replaces, complete = "", False
        with suppress(TolstatError):  # of another format, or too damaged to be read
            run = open_run(path, damaged=True)
            replaces, complete = run.replaces, run.complete
        if identified != replaces:
            raise RunFileError(
                f"{before} is in the way: the run that is replaced is kept there until "
                "the new one is complete; move that file, or give another name (-o)"
            )
        if not complete:
            return Before(before, identified, False)
    return Before(before, identity(path), True)


def linked_aside(path: Path) -> Path:
    """Give a file a second name, of this process alone."""
    aside = aside_of(path)
    give_second_name(path, aside)
    return aside


def check_replaceable(path: Path, *, force: bool) -> None:
    """Refuse to write over what exists, unless that is a run."""
    if not os.path.lexists(path):
        return
    if not path.is_file() or not is_run(path):
        raise RunFileError(f"{path} exists and is not a run; it is not replaced")
    if force:
        return
    advice = [Advice(Remedy.REPLACE, path)]
    with suppress(TolstatError):  # of another format, or too damaged to be read
        run = open_run(path, damaged=True)
        if run.damage or not run.complete:
            advice.append(Advice(Remedy.RESUME, path, run.machine))
    raise RunFileError(f"{path} exists already, and is replaced only by force", *advice)


def check_room(path: Path, size: int) -> None:
    """Refuse a file that does not fit on the disk with a copy of it."""
    try:
        free = shutil.disk_usage(path.parent).free
    except OSError as error:
        raise BrokenError(f"{path} cannot be written: {error}") from error
    most = largest_file()
    if size > most:
        raise BrokenError(
            f"{path}: the run needs a file of {size / 1e6:.3f} MB, and "
            f"{most / 1e6:.3f} MB are allowed (ulimit -f)"
        )
    if 2 * size > free:
        raise BrokenError(
            f"{path}: the run needs {2 * size / 1e6:.3f} MB for its file and a copy "
            f"at its end, and {free / 1e6:.3f} MB are free; make room, "
            "or write it to another disk"
        )
