"""Where compiled code is kept between sessions, and which source it is of.

Numba's cache sees only the file of the outermost function: an edit elsewhere would
give the old answer. So a folder is named by a digest of the source that decides the
numbers of one machine: the engine, and the machine's own files, whatever other machines
say of themselves. The folders of digests long unused are removed.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import time
import warnings
from functools import cache
from pathlib import Path

import platformdirs

PACKAGE = Path(__file__).parents[1]
ENGINE = ("lanes", "integrator", "model")
UNUSED_DAYS = 14.0


@cache
def source_digest(*sources: Path) -> str:
    """Digest the source that decides the numbers of a machine's trials.

    Parameters
    ----------
    *sources : Path
        Files of the machine, or of a function that is compiled; the engine alone where
        there is none.

    Returns
    -------
    str
        The same for the same source, whatever the computer; stored in every run. It is
        of the engine and of the package of each file, or of the file where it lies in
        no package.
    """
    digest = hashlib.sha256()
    engine = [path for floor in ENGINE for path in (PACKAGE / floor).rglob("*.py")]
    _add(digest, sorted([*engine, PACKAGE / "status.py"]), PACKAGE)
    for source in sources:
        _add(digest, _own(source), source.parent)
    return digest.hexdigest()[:16]


def _own(source: Path) -> list[Path]:
    """List the files that belong to a machine, the engine's left out."""
    if source.is_relative_to(PACKAGE) and not source.is_relative_to(
        PACKAGE / "machines"
    ):
        return []
    if (source.parent / "__init__.py").exists():
        return sorted(source.parent.rglob("*.py"))
    return [source]


def _add(digest: hashlib._Hash, paths: list[Path], folder: Path) -> None:
    for path in paths:
        digest.update(path.relative_to(folder).as_posix().encode())
        digest.update(path.read_bytes())


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
    folder = home / f"tolstat-{source_digest(source)}"
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
