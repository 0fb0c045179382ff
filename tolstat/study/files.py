"""Bounds of a study: the size and depth of its text, and the files that it may name."""

import errno
import math
import os
import re
import tomllib
from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from tolstat import regular_files
from tolstat.errors import DataError, StudyError
from tolstat.regular_files import as_text
from tolstat.study.problems import Problems
from tolstat.toml import DEEP_KEY, DEEPEST, toml_table, toml_text
from tolstat.units.grammar import MOST_NUMBER

LONGEST, LONGEST_KEY = 10_000, 200  # characters
TOO_DEEP = f"more than {DEEPEST} tables or lists inside each other"
MOST_MEGABYTES = 1  # of a study
TOO_LONG = "a number has thousands of digits; no key allows that"
TYPOGRAPHIC = "“”„‟‘’"
BACKSLASH = "in double quotes \\ begins an escape; write / between folders"


def check_bounds(
    table: Mapping[Any, Any], problems: Problems, outer: tuple[Any, ...] = ()
) -> None:
    """Refuse values that no key of a study can hold; `outer`: the keys of the table."""
    for key, value in table.items():
        path = (*outer, key)
        if wrong := _unusable(value, path):
            number = isinstance(value, int | float)
            problems.add(_key(path), value if number else None, wrong)
        if isinstance(value, list):
            value = {f"value {i}": item for i, item in enumerate(value, start=1)}
        if isinstance(value, Mapping) and len(path) <= DEEPEST:
            check_bounds(value, problems, path)


def _unusable(value: Any, path: tuple[Any, ...]) -> str:
    """Return why a study cannot hold a value there; empty if it can."""
    if len(path) > DEEPEST:
        return TOO_DEEP
    if not isinstance(path[-1], str):
        return "a text is expected as the name"
    if wrong := _unusable_text(path[-1], "key", LONGEST_KEY):
        return wrong
    if isinstance(value, str):
        return _unusable_text(value, "text", LONGEST)
    if isinstance(value, float) and not math.isfinite(value):
        return "a finite number is expected"
    if isinstance(value, int | float) and abs(value) > MOST_NUMBER:
        return f"a number of at most {MOST_NUMBER:g} is expected"
    return ""


def _unusable_text(text: str, kind: str, longest: int) -> str:
    if len(text) > longest:
        return f"a {kind} has {len(text)} characters; at most {longest} are allowed"
    if "\0" in text:
        return f"a {kind} contains the character NUL; remove it"
    try:
        text.encode()
    except UnicodeEncodeError:
        return f"a {kind} contains half a character; remove it"
    return ""


def _key(path: tuple[Any, ...]) -> str:
    """Return a place in a study: "trials", "[deviations] rod_length, cp"."""
    section, *rest = map(str, path)
    return f"[{section}] {', '.join(rest)}" if rest else section


def beside(folder: Path | None, name: str) -> Path:
    """Return the path of a file that a study names.

    It must lie in the study's folder or below, links resolved. Without a folder, as for
    a study given in Python, any file is allowed.
    """
    path = Path(name) if folder is None else folder / name
    if not name.isprintable():  # "rods\table.csv": TOML reads a tab
        raise DataError(f"{name!r}: a character of the name is a control; {BACKSLASH}")
    try:
        inside = not folder or path.resolve().is_relative_to(folder.resolve())
        of_windows = os.sep == "/" and "\\" in name and not path.exists()
    except (OSError, ValueError, RuntimeError) as error:
        raise DataError(f"{path} cannot be read: {error}") from None
    if of_windows:
        raise DataError(f"{path}: no such file; write / between folders, not \\")
    if folder and not inside:
        raise DataError(
            f"{path} lies outside the folder of the study; put the file into "
            f"{folder.resolve()}"
        )
    return path


def content(path: Path, megabytes: int) -> bytes:
    """Return the content of a file; refuse a larger one."""
    try:
        return regular_files.content(path, megabytes)
    except FileNotFoundError:
        names = [file.name for file in sorted(path.parent.glob(f"*{path.suffix}"))]
        hint = (
            f"in this folder: {', '.join(names)}" if names else "this folder has none"
        )
        if close := get_close_matches(path.name, names, n=1):
            hint = f"did you mean '{close[0]}'?"
        raise DataError(f"{path}: no such file; {hint}") from None
    except OSError as error:
        ours = error.errno in (errno.EFBIG, errno.EINVAL)
        why = f"is {error.strerror}" if ours else f"cannot be read: {error}"
        raise DataError(f"{path} {why}") from None


def study_text(path: Path) -> str:
    """Return the text of a study file."""
    return as_text(path, content(path, MOST_MEGABYTES))


def path_of_study(source: Any) -> Path | None:
    """Return the path of a study; None of a mapping. Others are refused."""
    if isinstance(source, Mapping):
        return None
    kind = type(source).__name__ * (not isinstance(source, str | os.PathLike))
    if isinstance(source, str) and "\n" in source:
        kind = "the text of a study: give tomllib.loads(text)"
    if kind:
        raise StudyError(f"a path or a mapping is expected, not {kind}")
    return Path(source)


def read_toml(source: Path | Mapping[str, Any]) -> tuple[str, dict[str, Any]]:
    """Return the text of a study and its keys; a study from Python becomes TOML."""
    if not isinstance(source, Path):
        try:
            text = toml_text(source)
        except (TypeError, ValueError, RecursionError) as error:
            why = TOO_DEEP if isinstance(error, RecursionError) else error
            raise StudyError(f"the study has a value that is not TOML: {why}") from None
        return text, _table(text, "the study")
    if source.suffix == ".h5":
        raise StudyError(f"{source} is a stored run; a study is a .toml file")
    try:
        text = study_text(source)
    except DataError as error:
        raise StudyError(f"{error}") from None
    return text, _table(text, f"{source}")


def _table(text: str, source: str) -> dict[str, Any]:
    """Return the keys of a TOML file."""
    lines = text.split("\n")
    try:
        return toml_table(text)
    except tomllib.TOMLDecodeError as error:
        hint = f"; {BACKSLASH}" if _in_escape(lines, str(error)) else ""
        if any(sign in text for sign in TYPOGRAPHIC):
            hint = '; typographic quotes are none here: write straight ones, "'
        raise StudyError(f"{source} is not a TOML file: {error}{hint}") from None
    except RecursionError:
        deep = DEEP_KEY.search(text)
        line = max(lines, key=lambda line: line.count("[") + line.count("{"))
        line, why = deep[0] if deep else line, TOO_DEEP
    except ValueError:
        line = max(lines, key=lambda line: sum(map(str.isdigit, line)))
        why = TOO_LONG
    raise StudyError(f"{source} cannot be run:\n  {line[:40]}...: {why}")


def _in_escape(lines: Sequence[str], error: str) -> bool:
    """Return whether an error of TOML lies behind a backslash in double quotes."""
    position = re.search(r"line (\d+), column (\d+)", error)
    line, column = map(int, position.groups()) if position else (1, 1)
    return "\\" in lines[line - 1][:column].rpartition('"')[2]
