"""Where compiled code is kept between sessions.

Numba's cache sees only the file of the outermost function, whose bytes it compares: an
edit elsewhere would give the old answer. So a folder is named by a digest of all that
the file computes. Within a folder entries go by file and line, and hold for one state
of the file: a moved line compiles again, and no two entries cross. The folders of
digests long unused are removed.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import time
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path

import platformdirs

from tolstat.lanes.digest import Place, digest

# what is compiled into every function: it may be reached by no name
ENGINE = (
    Place(Path(__file__).with_name("compiled.py"), "compiled"),
    Place(Path(__file__).with_name("rows.py"), "rows"),
)
UNUSED_DAYS = 14.0


@cache
def cache_folder(source: Path, module: str) -> str | None:
    """Find and prepare the folder of the compiled code of a source file.

    Parameters
    ----------
    source : Path
        The file of a function that is compiled.
    module : str
        As what that file is imported: Numba looks for the same again, and a machine of
        one's own may be a script today and part of a package tomorrow.

    Returns
    -------
    str or None
        None where nothing can be written: a warning says so, and every session
        compiles anew. The environment variable NUMBA_CACHE_DIR moves the folder.
    """
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    home = Path(chosen) if chosen else platformdirs.user_cache_path("tolstat")
    folder = home / f"tolstat-{digest(Place(source), *ENGINE)}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "used").touch()
    except OSError as error:
        warnings.warn(
            f"compiled code cannot be kept in {folder} ({error.strerror}): every "
            "session compiles anew; set NUMBA_CACHE_DIR to a folder you can write",
            RuntimeWarning,
            stacklevel=2,
        )
        return None
    _remove_unused(home, folder)
    return str(folder / module)


@contextmanager
def alone_in(folder: str) -> Iterator[None]:
    """Let one process at a time compile here: what another half wrote is no damage."""
    try:
        import fcntl
    except ImportError:  # not on every system
        yield
        return
    with open(Path(folder).parent / "used", "ab") as file:
        with suppress(OSError):  # no locks in this file system
            fcntl.flock(file, fcntl.LOCK_EX)
        yield


def remove_damaged(folder: str) -> list[str]:
    """Remove compiled code that is not as it was written: it could do anything.

    Parameters
    ----------
    folder : str
        Of `cache_folder`.

    Returns
    -------
    list of str
        Names of what was damaged. What nobody vouches for is removed without a word.
    """
    damaged = []
    for path in _kept(folder):
        mark = _mark_of(path)
        known = mark.read_bytes() if mark.is_file() else None
        if known != _digest_of(path):
            damaged += [path.name] if known is not None else []
            path.unlink(missing_ok=True)
    return damaged


def vouch_for(folder: str) -> None:
    """Write beside each file of compiled code what tells that it is whole."""
    for path in _kept(folder):
        mark, digest = _mark_of(path), _digest_of(path)
        if not (mark.is_file() and mark.read_bytes() == digest):
            aside = mark.with_name(f"{mark.name}.{os.getpid()}")
            aside.write_bytes(digest)
            aside.replace(mark)


def _kept(folder: str) -> list[Path]:
    return [path for path in Path(folder).rglob("*.nb[ic]") if path.is_file()]


def _mark_of(path: Path) -> Path:
    return path.with_name(f"{path.name}.sha256")


def _digest_of(path: Path) -> bytes:
    return hashlib.sha256(path.read_bytes()).hexdigest().encode()


def _remove_unused(home: Path, kept: Path) -> None:
    """Remove folders of other sources that nobody used for UNUSED_DAYS."""
    oldest = time.time() - UNUSED_DAYS * 86400.0
    for folder in home.glob("tolstat-*"):
        mark = folder / "used"
        if folder != kept and mark.exists() and mark.stat().st_mtime < oldest:
            shutil.rmtree(folder, ignore_errors=True)
