"""Where compiled code is kept between sessions.

Numba's cache sees only the file of the outermost function: an edit elsewhere would
give the old answer. So the folder is named by a digest of the source of the floors
that compile, and the folders of digests long unused are removed.
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

COMPILED_FLOORS = ("lanes", "integrator", "machines")
UNUSED_DAYS = 14.0


@cache
def source_digest() -> str:
    """Digest the source that decides a trial's numbers.

    Returns
    -------
    str
        The same for the same source, whatever the machine; stored in every run.
    """
    package = Path(__file__).parents[1]
    digest = hashlib.sha256()
    for floor in COMPILED_FLOORS:
        for path in sorted((package / floor).rglob("*.py")):
            digest.update(path.relative_to(package).as_posix().encode())
            digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


@cache
def cache_folder() -> str | None:
    """Find and prepare the folder of this source's compiled code.

    Returns
    -------
    str or None
        None where nothing can be written: a warning says so, and every session
        compiles anew. The environment variable NUMBA_CACHE_DIR moves the folder.
    """
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    home = Path(chosen) if chosen else platformdirs.user_cache_path("tolstat")
    folder = home / f"tolstat-{source_digest()}"
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
    return str(folder)


def _remove_unused(home: Path, kept: Path) -> None:
    """Remove folders of other sources that nobody used for UNUSED_DAYS."""
    oldest = time.time() - UNUSED_DAYS * 86400.0
    for folder in home.glob("tolstat-*"):
        mark = folder / "used"
        if folder != kept and mark.exists() and mark.stat().st_mtime < oldest:
            shutil.rmtree(folder, ignore_errors=True)
