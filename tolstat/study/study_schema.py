"""The study file as it is written: its keys and their types."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any, get_args, get_origin, get_type_hints

import tomli_w

from tolstat.errors import DataError, StudyError, allowed_names
from tolstat.study.files import as_text, content
from tolstat.study.problems import Problems
from tolstat.study.study_bounds import DEEPEST, TOO_DEEP, check_bounds

MOST_MEGABYTES = 1  # of a study
MOST_SEED = 2**64 - 1
TITLE_BLOCK = ("project", "drawing", "revision", "author", "approval")
A_TEXT = (
    'a text in quotes is expected, such as revision = "B"; in [document] may stand '
    f"{', '.join(TITLE_BLOCK)}"
)
A_SEED = f"a whole number from 0 to {MOST_SEED} is expected"
IN_RANGE = {"trials": lambda n: n > 0, "seed": lambda n: 0 <= n <= MOST_SEED}
NO_SUCH_KEY = "a study has no such key; "
MISSING = {
    "model": 'missing; name a machine, such as model = "stand"',
    "trials": "missing; say how many machines to build, such as trials = 4096",
    "seed": "missing; a whole number, such as seed = 75: it makes the run repeatable",
}
TOO_LONG = "a number of thousands of digits; no key of a study takes one"
NAME = r"""(?:[\w-]+|"[^"\n]*"|'[^'\n]*')"""
DEEP_KEY = re.compile(rf"(?<![\w.-])(?:{NAME}[ \t]*\.[ \t]*){{{DEEPEST}}}")  # a.b.c ...


@dataclass(frozen=True)
class Document:
    """A study file before its names and quantities are read: keys, types, hints."""

    model: Annotated[str, "the name of a machine is expected, in quotes"]
    title: Annotated[str, "a text is expected"] = ""
    document: Annotated[dict[str, str], A_TEXT] = field(default_factory=dict)
    trials: Annotated[
        int | dict[str, Any] | None,
        "a whole number from 1 is expected, or a stopping rule such as "
        '{ until = "extra_loss p95 +-2 %", at_most = 200000 }',
    ] = None
    seed: Annotated[int | None, A_SEED] = None
    sampling: Annotated[
        str | dict[str, Any],
        "the name of a sampling is expected, in quotes, or of what is rare: "
        '{ rare = "extra_loss" }',
    ] = "random"
    table: Annotated[
        str | None,
        'the name of a CSV file is expected, such as table = "machines.csv"',
    ] = None
    settings: Annotated[
        dict[str, Any],
        "a table of settings is expected: in each line name = value",
    ] = field(default_factory=dict)
    links: Annotated[
        dict[str, str | int | float | dict[str, Any]],
        'a link is expected, such as { nominal = "60 mm", tolerance = "+-0.015 mm" }, '
        'or "2 mm" for one that does not deviate',
    ] = field(default_factory=dict)
    deviations: Annotated[
        dict[str, str | dict[str, Any]],
        'a tolerance such as "+-1.2 mm" or { tolerance = "+-1.2 mm", cp = 1.33 } is '
        "expected",
    ] = field(default_factory=dict)
    correlation: Annotated[
        dict[str, dict[str, float]],
        "a table of rank correlations is expected, such as { rod_length_2 = 0.6 }",
    ] = field(default_factory=dict)
    grid: Annotated[
        dict[str, Any],
        "a table of contributors or settings and their values is expected",
    ] = field(default_factory=dict)
    reference: Annotated[
        dict[str, Any],
        'a table such as { data = "points.csv", label = "measured" } is expected',
    ] = field(default_factory=dict)
    limits: Annotated[
        dict[str, str | dict[str, Any]],
        'a limit such as "<= 3 %" or { limit = "<= 3 %", yield = "99 %" } is expected',
    ] = field(default_factory=dict)


def read(source: Path | Mapping[str, Any], problems: Problems) -> tuple[str, Document]:
    """Read a study and check its keys; return its text and content."""
    text, table = _of_file(source) if isinstance(source, Path) else _of_mapping(source)
    check_bounds(table, problems)
    problems.raise_if_any()
    if "model" not in table:
        problems.add("model", None, MISSING["model"])
    for key, value in table.items():
        _check(key, value, problems)
    problems.raise_if_any()
    return text, Document(**table)


def instead(document: Document, problems: Problems, *typed: int | None) -> Document:
    """Return a study with trials and seed that the caller gives instead of its own."""
    named = zip(("trials", "seed"), typed, strict=True)
    given: dict[str, Any] = {k: value for k, value in named if value is not None}
    check_bounds(given, problems)
    for key, value in given.items():
        _check(key, value, problems)
    problems.raise_if_any()
    return replace(document, **given)


def _check(key: str, value: Any, problems: Problems) -> None:
    """Refuse a key that no study has, and values of another type."""
    hints = get_type_hints(Document, include_extras=True)
    if key not in hints:
        problems.add(key, None, NO_SUCH_KEY + allowed_names(key, hints))
        return
    kind, expected = get_args(hints[key])
    whole = type(value) is int
    if get_origin(kind) is not dict or not isinstance(value, dict):
        if not _fits(value, kind) or (whole and not IN_RANGE[key](value)):
            problems.add(key, value, expected)
        return
    for name, each in value.items():
        if key == "document" and name not in TITLE_BLOCK:
            known = allowed_names(name, TITLE_BLOCK)
            problems.add(f"[{key}] {name}", None, NO_SUCH_KEY + known)
        elif not _fits(each, get_args(kind)[1]):
            problems.add(f"[{key}] {name}", each, expected)


def _fits(value: Any, kind: Any) -> bool:
    """Tell whether a value of a TOML file is of a type; true is no number."""
    if get_origin(kind) is dict:
        of = get_args(kind)[1]
        return isinstance(value, dict) and all(_fits(x, of) for x in value.values())
    if kinds := get_args(kind):
        return any(_fits(value, each) for each in kinds)
    return kind is Any or type(value) in ((int, float) if kind is float else (kind,))


def _of_file(path: Path) -> tuple[str, dict[str, Any]]:
    """Return the text of a TOML file, and what it holds."""
    if path.suffix == ".h5":
        raise StudyError(f"{path} is a stored run; a study is a .toml file")
    try:
        text = as_text(content(path, MOST_MEGABYTES), "utf-8")
    except FileNotFoundError:
        near = [str(p) for p in sorted(path.parent.glob("*.toml"))]
        hint = (
            allowed_names(str(path), near) if near else "no study lies in that folder"
        )
        raise StudyError(f"{path}: there is no such file; {hint}") from None
    except DataError as error:
        raise StudyError(f"{error}") from None
    except (OSError, UnicodeDecodeError) as error:
        raise StudyError(f"{path} cannot be read: {error}") from None
    return text, _table(text, f"{path}")


def _table(text: str, source: str) -> dict[str, Any]:
    """Return what a TOML file holds."""
    if found := DEEP_KEY.search(text):  # which tomllib would take minutes to read
        raise _unreadable(source, found[0], TOO_DEEP)
    lines = text.split("\n")
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise StudyError(f"{source} is not a TOML file: {error}") from None
    except RecursionError:
        deepest = max(lines, key=lambda line: line.count("[") + line.count("{"))
        raise _unreadable(source, deepest, TOO_DEEP) from None
    except ValueError:
        longest = max(lines, key=lambda line: sum(map(str.isdigit, line)))
        raise _unreadable(source, longest, TOO_LONG) from None


def _unreadable(source: str, line: str, why: str) -> StudyError:
    return StudyError(f"{source} cannot be run:\n  {line[:40]}...: {why}")


def _of_mapping(given: Mapping[str, Any]) -> tuple[str, dict[str, Any]]:
    """Write a study given in Python as a study file, and return what that holds."""
    try:
        text = tomli_w.dumps(given)
    except (TypeError, ValueError, RecursionError) as error:
        reason = TOO_DEEP if isinstance(error, RecursionError) else error
        raise StudyError(f"the study holds what no study file can: {reason}") from None
    return text, _table(text, "the study")
