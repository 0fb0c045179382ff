"""Files that a study is in, or names: regular ones, beside it, of a bounded size."""

from __future__ import annotations

import io
import stat
from pathlib import Path

from tolstat.errors import DataError

MEGABYTE = 1_000_000


def beside(folder: Path | None, name: str) -> Path:
    """Return the file that a study names; it lies in the study's folder, or below.

    One that lies elsewhere, links resolved, is refused. Who writes Python, without a
    folder, reads anything.
    """
    path = Path(name) if folder is None else folder / name
    try:
        inside = not folder or path.resolve().is_relative_to(folder.resolve())
        kind = path.stat().st_mode if inside and path.exists() else stat.S_IFREG
    except (OSError, ValueError, RuntimeError) as error:
        raise DataError(f"{path} cannot be read: {error}") from None
    if folder and not inside:
        raise DataError(
            f"{path} lies outside the folder of the study, and a study reads nothing "
            f"there; put the file into {folder.resolve()}"
        )
    if not stat.S_ISREG(kind):
        raise DataError(f"{path} is no file, but a folder or a device")
    return path


def content(path: Path, megabytes: int) -> bytes:
    """Return the content of a file; refuse a larger one, read no further."""
    most = megabytes * MEGABYTE
    with path.open("rb") as file:
        found = file.read(most + 1)
    if len(found) > most:
        raise DataError(f"{path} is larger than {megabytes} MB, and no more is read")
    return found


def as_text(found: bytes, encoding: str) -> str:
    """Decode the content of a text file; every line ends as Python's do."""
    return io.TextIOWrapper(io.BytesIO(found), encoding).read()
