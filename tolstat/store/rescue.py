"""A copy of a run file that was removed or moved while it was written."""

from __future__ import annotations

import os
import shutil
import tempfile
from contextlib import suppress
from pathlib import Path
from typing import BinaryIO

from tolstat.errors import BrokenError
from tolstat.store.lock import Lock
from tolstat.store.temporary_files import free_name


def is_still(file: BinaryIO, path: Path) -> bool:
    """Tell whether an open file is what a path names."""
    try:
        return os.path.samestat(os.fstat(file.fileno()), path.stat())
    except OSError:
        return False


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
