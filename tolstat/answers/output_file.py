"""Output files: which may be replaced, and how."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

from tolstat.document.blocks import PICTURES
from tolstat.errors import RunFileError
from tolstat.operating_system import held_open
from tolstat.regular_files import content as content_of
from tolstat.regular_files import marked_encoding
from tolstat.store.files_beside import create_aside
from tolstat.store.integrity import is_run

KEPT = {".h5": "a run", ".toml": "a study"}  # by the ending of its name
MEGABYTES = 1  # of a study
ESCAPE = re.compile(r"\\[uU]([0-9a-fA-F]{8}|[0-9a-fA-F]{4})")  # of TOML
PathLike = str | os.PathLike[str]
Contents = Mapping[str, Callable[[], str | bytes]]  # by the ending of the file


def check_folder(path: Path) -> None:
    """Refuse a file whose folder does not exist, before anything is computed.

    Raises
    ------
    RunFileError
        If there is no such folder.
    """
    if not path.parent.is_dir():
        raise RunFileError(f"{path} cannot be written: no such folder")
    try:
        path.resolve()
    except (OSError, RuntimeError) as error:  # links in a circle
        raise RunFileError(f"{path} cannot be written: {error}") from error


def check_output(path: Path) -> None:
    """Refuse a file that no answer may replace, before anything is computed.

    Parameters
    ----------
    path : Path
        File for a page, a picture or numbers. The file of an earlier answer is
        replaced.

    Raises
    ------
    RunFileError
        If the folder does not exist, the ending is that of a run or a study, or the
        file is a run or is read by a study.
    """
    check_folder(path)
    for name in (path, path.resolve()):
        if kind := KEPT.get(name.suffix.lower()):
            raise RunFileError(
                f"{path} is not written: {name.suffix} is the ending of {kind}; give "
                "another name"
            )
    if not path.is_file():
        return
    if is_run(path):
        raise RunFileError(f"{path} is a run and is not replaced; give another name")
    names = path.absolute(), path.resolve()  # a study may name a link
    if study := next(filter(None, map(_reader, dict.fromkeys(names))), None):
        raise RunFileError(
            f"{path} is named in {study} and is not replaced; give another name"
        )


def check_ending(path: Path, kind: str, endings: Sequence[str]) -> None:
    """Refuse a file of another ending, or one that no answer may replace."""
    check_output(path)
    if path.suffix.lower() not in endings:
        *others, last = endings
        raise RunFileError(
            f"{path}: the name of {kind} ends in {', '.join(others)} or {last}"
        )


def save(path: PathLike, kind: str, contents: Contents) -> Path:
    """Write the content that belongs to the ending of a file; return its path.

    Raises
    ------
    RunFileError
        If the ending is not allowed, or the file cannot be written or replaced.
    """
    path = Path(path)
    check_ending(path, kind, [*contents])
    content = contents[path.suffix.lower()]()
    return replace(path, content.encode() if isinstance(content, str) else content)


def as_pictures(draw: Callable[[], Any]) -> Contents:
    """Return a figure of Matplotlib as the content of each kind of picture."""

    def content(ending: str) -> bytes:
        from tolstat.render.picture import picture  # slow to import

        return picture(draw(), ending)

    return {ending: partial(content, ending) for ending in PICTURES}


def _reader(path: Path) -> Path | None:
    """Return a study that names a file: studies read in their folder and below."""
    named = re.compile(rf"""["'/]{re.escape(path.name)}["']""")
    for folder in path.parents:
        for study in sorted(folder.glob("*.toml")):
            with suppress(OSError):
                if named.search(_as_read(content_of(study, MEGABYTES))):
                    return study
    return None


def _as_read(content: bytes) -> str:
    """Return the text of a study, with its escapes read; any bytes have one."""
    mark = marked_encoding(content)
    words = content.decode(mark or "utf-8", "replace" if mark else "surrogateescape")
    return ESCAPE.sub(lambda x: chr(min(int(x[1], 16), sys.maxunicode)), words)


def replace(path: Path, content: bytes | Callable[[Path], object]) -> Path:
    """Write a file under a temporary name, then rename it; return its path.

    An earlier file stays until then. The content is bytes, or a function that writes.

    Raises
    ------
    RunFileError
        If it cannot be written.
    """

    def write(target: Path) -> object:
        return content(target) if callable(content) else target.write_bytes(content)

    try:
        if path.exists() and not path.is_file():  # a pipe, a terminal
            with held_open(path):
                write(path)
            return path
        target = path.resolve()  # a link stays one
        aside, file = create_aside(target)
        file.close()
        try:
            write(aside)
            os.replace(aside, target)
        finally:
            with suppress(OSError):
                aside.unlink()
    except OSError as error:
        raise RunFileError(f"{path} cannot be written: {error}") from error
    return path
