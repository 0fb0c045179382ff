"""Folder of compiled code that is kept between sessions, and what the compiler is told.

Numba's cache compares only the file of the outermost function: after an edit of another
file it would return the old code. So a folder is named by a digest of everything that
the file computes, and of what the compiler is told: processor and level, which users
may change. Within a folder, entries are by file and line, and for one state of the
file: a moved line compiles again, and entries never mix. Folders of digests that are
long unused are removed.
"""

import hashlib
import json
import os
import shutil
import time
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import platformdirs

from tolstat.lanes.digest import digest
from tolstat.operating_system import lock, make_private

# LLVM's third level does not make equations faster, and takes a tenth longer
LEVEL = 2


@contextmanager
def settings_of_numba(folder: str | None = None) -> Iterator[None]:
    """Give Numba our level and a folder for its cache; restored, as they are global."""
    from numba import config

    before = config.CACHE_DIR, config.OPT
    try:
        config.CACHE_DIR = folder or before[0]
        config.OPT = min(type(before[1])(LEVEL), before[1])  # a type of Numba
        yield
    finally:
        config.CACHE_DIR, config.OPT = before


@cache
def machine_code() -> str:
    """Return what identifies compiled code, beside source and version of Numba."""
    from llvmlite import binding
    from numba import config
    from numba.core.registry import cpu_target

    if config.DISABLE_JIT:
        return "none: NUMBA_DISABLE_JIT is set"
    with settings_of_numba():
        level = int(config.OPT)
        target, cpu, features = cpu_target.target_context.codegen().magic_tuple()
    options = f"{features} {config.LOOP_VECTORIZE} {config.SLP_VECTORIZE}"
    digest = hashlib.sha256(options.encode()).hexdigest()[:8]
    llvm = ".".join(map(str, binding.llvm_version_info))
    return f"{target} {cpu}, features {digest}, level {level}, LLVM {llvm}"


# compiled into every function, although its file may not import it
ENGINE = tuple(Path(__file__).with_name(name) for name in ("compiled.py", "rows.py"))
UNUSED_DAYS = 14.0


@cache
def cache_folder(source: Path, module: str) -> str | None:
    """Return the folder of the compiled code of a source file, and create it.

    Parameters
    ----------
    source : Path
        File of a compiled function.
    module : str
        Name under which the file is imported. Numba looks for the same name, and a
        custom model may be a script first and part of a package later.

    Returns
    -------
    str or None
        None if nothing can be written, or if others may write there, whose code would
        be executed: a warning says so, and every session compiles again. The
        environment variable NUMBA_CACHE_DIR moves the folder.
    """
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    home = Path(chosen) if chosen else platformdirs.user_cache_path("tolstat")
    name = f"tolstat-{digest(source, *ENGINE, machine_code())}"
    try:
        folder = (home / name).resolve()  # a link may lead elsewhere later
        make_private(folder)
        (folder / "used").touch()
    except (OSError, RuntimeError) as error:  # links in a circle
        reason = getattr(error, "strerror", error)
        warnings.warn(
            f"compiled code cannot be kept in {home / name} ({reason}): every session "
            "compiles again; set NUMBA_CACHE_DIR to a folder that you alone can write",
            RuntimeWarning,
            stacklevel=2,
        )
        return None
    _remove_unused(folder)
    return str(folder / module)


@contextmanager
def intact(folder: str) -> Iterator[list[str]]:
    """Yield the names of damaged files, while no other process compiles.

    Damaged and unfinished files are removed first, because their effect is
    unpredictable.
    """
    home = Path(folder)
    home.mkdir(exist_ok=True)
    written = home / "written.json"
    with open(home.parent / "used", "ab") as file:
        lock(file, wait=True)  # without locks, processes compile twice
        recorded = json.loads(written.read_bytes()) if written.exists() else {}
        digests = _digests(home)
        changed = [
            name for name, digest in digests.items() if recorded.get(name) != digest
        ]
        for name in changed:
            (home / name).unlink(missing_ok=True)
        yield [Path(name).name for name in changed if name in recorded]
        temporary = home / f"written.{os.getpid()}"
        temporary.write_text(json.dumps(_digests(home)))
        temporary.replace(written)


def _digests(home: Path) -> dict[str, str]:
    return {
        str(path.relative_to(home)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in home.rglob("*.nb[ic]")
    }


def _remove_unused(current: Path) -> None:
    """Remove folders of other sources, unused for UNUSED_DAYS."""
    oldest = time.time() - UNUSED_DAYS * 86400.0
    for folder in current.parent.glob("tolstat-*"):
        mark = folder / "used"
        if folder != current and mark.exists() and mark.stat().st_mtime < oldest:
            shutil.rmtree(folder, ignore_errors=True)
