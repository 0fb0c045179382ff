"""Files beside a run: the lock of its one writer, temporary ones, what it replaces."""

import hashlib
import os
import re
import secrets
import shutil
import socket
import stat
from contextlib import AbstractContextManager, ExitStack, suppress
from itertools import count
from pathlib import Path
from typing import IO, Any, BinaryIO

from tolstat.errors import Advice, BrokenError, Remedy, RunFileError, TolstatError
from tolstat.operating_system import (
    give_owner,
    is_mine,
    largest_file,
    lock,
    process_exists,
)
from tolstat.regular_files import created, opened, opened_for_writing
from tolstat.store.integrity import is_run
from tolstat.store.open_run import open as open_run
from tolstat.store.provenance import now

WORDS = "process "  # what a lock begins with
LONGEST = 1000  # bytes of it
UNREADABLE = "unreadable"  # in place of an identity


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
            with suppress(OSError):
                self._lock.parent.mkdir(parents=True, exist_ok=True)
            self._file = self._taken()
        except (OSError, RuntimeError) as error:  # links in a circle
            raise BrokenError(f"{path} cannot be written: {error}") from error
        with suppress(OSError):  # a full disk: the lock holds without its words
            self._file.truncate(0)
            self._file.seek(0)
            holder = f"{os.getpid()} on {socket.gethostname()} since {now()}"
            self._file.write(f"{WORDS}{holder}".encode())

    def _taken(self) -> BinaryIO:
        """Return the lock, open, locked and still in its place."""
        while True:
            with ExitStack() as stack:
                file = stack.enter_context(opened_for_writing(self._lock))
                words = _words_of(file)
                if words and not words.startswith(WORDS):
                    raise RunFileError(
                        f"{self._lock} is not a lock of tolstat; rename that file, or "
                        "give the run another name"
                    )
                if not lock(file):
                    # its holder may have written its name since
                    holder = _words_of(file).strip() or "another process"
                    raise RunFileError(
                        f"{self.path} is being written by {holder}; wait for it, or "
                        "give another name"
                    )
                if is_still(file, self._lock):  # else its holder has just removed it
                    stack.pop_all()
                    return file

    def __exit__(self, *_: object) -> None:
        """Release the lock."""
        with suppress(OSError):
            self._lock.unlink()
        with suppress(OSError):
            self._file.close()


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
    try:
        with opened(_lock_of(path)) as file:
            words = _words_of(file).strip()
    except (OSError, RuntimeError):  # links in a circle
        return ""
    if not words.startswith(WORDS):
        return ""
    holder = re.match(
        rf"process (\d+) on {re.escape(socket.gethostname())} since ", words
    )
    return "" if holder and not process_exists(int(holder[1])) else words


def _words_of(file: BinaryIO) -> str:
    """Return what a lock says of its holder; a new one is not read, so none is left."""
    if not os.fstat(file.fileno()).st_size:
        return ""
    file.seek(0)
    return file.read(LONGEST).decode(errors="replace")


def _lock_of(path: Path) -> Path:
    """Return the lock of a run file; for a link, that of its target."""
    real = path.resolve()
    return real.with_name(f"{real.name}.lock")


def aside_of(path: Path) -> Path:
    """Return a temporary name beside a path, which cannot be predicted.

    Files of such names that dead processes of this user left there are removed.
    """
    names = re.compile(re.escape(path.name) + r"\.([0-9]{1,9})-[0-9a-f]+\.part")
    for file in path.parent.iterdir():
        name = names.fullmatch(file.name)
        if name and not process_exists(int(name[1])):
            with suppress(OSError):
                status = file.lstat()
                if stat.S_ISREG(status.st_mode) and is_mine(status):
                    file.unlink()
    return path.with_name(f"{path.name}.{os.getpid()}-{secrets.token_hex(8)}.part")


def create_aside(path: Path, before: BinaryIO | None = None) -> tuple[Path, BinaryIO]:
    """Return a temporary file beside a path, open and unbuffered.

    It has the permissions of the file that it will replace, or of the open one before
    it, and its owner where that may be given; without one, those of a new file.
    """
    aside = aside_of(path)
    try:
        status = os.fstat(before.fileno()) if before else path.stat()
    except FileNotFoundError:
        return aside, created(aside, 0o666)
    mode = stat.S_IMODE(status.st_mode)
    file = created(aside, mode)
    give_owner(aside, status)
    aside.chmod(mode)  # the umask may have taken some
    return aside, file


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

    Empty if there is nothing of this name; a word for what cannot be read.
    """
    try:
        with opened(path) as file:
            return hashlib.sha256(file.read(4096)).hexdigest()[:16]
    except FileNotFoundError:
        return ""
    except OSError:
        return UNREADABLE


def run_before(path: Path) -> tuple[str, bool]:
    """Return the identity of the run kept as RUN.h5.before when a new one replaces one.

    And whether it is the run that is replaced now, and is not there yet. Where an
    interrupted run is replaced that had itself replaced one, that one is kept on: it
    came to its end.

    Raises
    ------
    RunFileError
        If another file of this name is there, which is not removed.
    """
    before = before_of(path)
    if identified := identity(before):
        if before.samefile(path):  # of a replacement that was killed
            return identified, False
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
            return identified, False
    return identity(path), True


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
