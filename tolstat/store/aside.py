"""Files written aside and renamed: what may be replaced, and whether there is room."""

from __future__ import annotations

import os
import shutil
from contextlib import suppress
from itertools import count
from pathlib import Path

import h5py

from tolstat.errors import RunFileError

_numbers = count()


def aside_of(path: Path) -> Path:
    """Name a file beside a path, of this process alone; remove those of dead ones.

    Parameters
    ----------
    path : Path
        What it is to become.
    """
    for left in path.parent.glob(f"{path.name}.*.part"):
        process = left.name.removeprefix(f"{path.name}.").partition("-")[0]
        if process.isdigit() and not _alive(int(process)):
            with suppress(OSError):
                left.unlink()
    return path.with_name(f"{path.name}.{os.getpid()}-{next(_numbers)}.part")


def _alive(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except OSError:  # somebody else's
        return True
    return True


def check_replaceable(path: Path, *, force: bool) -> None:
    """Refuse to write over what exists, unless that is a run nobody is writing.

    Raises
    ------
    RunFileError
        If the path is taken, by a run without force, or by anything else.
    """
    if not os.path.lexists(path):
        return
    if not path.is_file() or not h5py.is_hdf5(path):
        raise RunFileError(f"{path} exists and is no run; it is not replaced")
    try:
        h5py.File(path, "r+").close()
    except BlockingIOError:
        raise RunFileError(f"{path}: another run is writing it") from None
    except OSError:
        pass  # damaged, or read only: as it may be
    if not force:
        raise RunFileError(
            f"{path} exists already; give --force (force=True) to replace it, or -o "
            "(output=) for another name"
        )


def check_room(folder: Path, size: int) -> None:
    """Refuse to begin a file that cannot be finished: HDF5 dies of a full disk.

    Parameters
    ----------
    folder : Path
        Where it is to lie.
    size : int
        Bytes that it will have.

    Raises
    ------
    RunFileError
        If that much is not free, or more than a file may have.
    """
    try:
        free = shutil.disk_usage(folder).free
    except OSError as error:
        raise RunFileError(f"{folder} cannot be written: {error}") from error
    with suppress(ImportError):  # not on every system
        import resource

        most, _ = resource.getrlimit(resource.RLIMIT_FSIZE)
        free = free if most == resource.RLIM_INFINITY else min(free, most)
    if size > free:
        raise RunFileError(
            f"{folder}: the run needs {size / 1e6:.1f} MB, and {free / 1e6:.1f} MB are "
            "free; make room, or write it elsewhere (-o)"
        )
