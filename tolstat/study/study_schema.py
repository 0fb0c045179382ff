"""The study file as it is written: its keys and their types."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import tomli_w
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from tolstat.errors import DataError, StudyError, allowed_names
from tolstat.study.files import as_text, content
from tolstat.study.problems import Problems
from tolstat.study.study_bounds import DEEPEST, TOO_DEEP, check_bounds

MOST_MEGABYTES = 1  # of a study
MOST_SEED = 2**64 - 1
TOO_LONG = "a number of thousands of digits; no key of a study takes one"
NAME = r"""(?:[\w-]+|"[^"\n]*"|'[^'\n]*')"""
DEEP_KEY = re.compile(rf"(?<![\w.-])(?:{NAME}[ \t]*\.[ \t]*){{{DEEPEST}}}")  # a.b.c ...


class TitleBlock(BaseModel):
    """What stands on the sheet that is signed."""

    model_config = ConfigDict(extra="forbid", strict=True)

    project: str = ""
    drawing: str = ""
    revision: str = ""
    author: str = ""
    approval: str = ""


class Document(BaseModel):
    """A study file before its names and quantities are looked at."""

    model_config = ConfigDict(extra="forbid", strict=True)

    title: str = ""
    document: TitleBlock = TitleBlock()
    model: str
    trials: Annotated[int, Field(ge=1)] | dict[str, Any] | None = None
    seed: int | None = Field(default=None, ge=0, le=MOST_SEED)
    sampling: str | dict[str, Any] = "random"
    table: str | None = None
    settings: dict[str, Any] = {}
    links: dict[str, str | int | float | dict[str, Any]] = {}
    deviations: dict[str, str | dict[str, Any]] = {}
    correlation: dict[str, dict[str, float]] = {}
    grid: dict[str, Any] = {}
    reference: dict[str, Any] = {}
    limits: dict[str, str | dict[str, Any]] = {}


MISSING = {
    "model": 'missing; name a machine, such as model = "stand" (`tolstat models`)',
    "trials": "missing; say how many machines to build, such as trials = 4096",
    "seed": "missing; a whole number, such as seed = 75: it makes the run repeatable",
}

EXPECTED = {
    "title": "a text is expected",
    "document": 'a text in quotes is expected, such as revision = "B"; in [document] '
    f"may stand {', '.join(TitleBlock.model_fields)}",
    "model": "the name of a machine is expected, in quotes",
    "trials": "a whole number from 1 is expected, or a stopping rule such as "
    '{ until = "extra_loss p95 +-2 %", at_most = 200000 }',
    "seed": f"a whole number from 0 to {MOST_SEED} is expected",
    "sampling": "the name of a sampling is expected, in quotes, or of what is rare: "
    '{ rare = "extra_loss" }',
    "table": 'the name of a CSV file is expected, such as table = "machines.csv"',
    "settings": "a table of settings is expected (`tolstat show MODEL` lists them)",
    "links": 'a link is expected, such as { nominal = "60 mm", tolerance = '
    '"+-0.015 mm" }, or "2 mm" for one that does not deviate',
    "deviations": 'a tolerance such as "+-1.2 mm" or { tolerance = "+-1.2 mm", '
    "cp = 1.33 } is expected",
    "correlation": "a table of rank correlations is expected, such as "
    "{ rod_length_2 = 0.6 }",
    "grid": "a table of contributors or settings and their values is expected",
    "reference": 'a table such as { data = "points.csv", label = "measured" } is '
    "expected",
    "limits": 'a limit such as "<= 3 %" or { limit = "<= 3 %", yield = "99 %" } is '
    "expected",
}


def read(source: Path | Mapping[str, Any], problems: Problems) -> tuple[str, Document]:
    """Read a study and check its keys; return its text and content."""
    text, table = _of_file(source) if isinstance(source, Path) else _of_mapping(source)
    check_bounds(table, problems)
    problems.raise_if_any()
    try:
        return text, Document.model_validate(table)
    except ValidationError as error:
        for each in error.errors():
            _note(each, table, problems)
        problems.raise_if_any()
        raise


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


def _note(error: Any, table: dict[str, Any], problems: Problems) -> None:
    """Say one of pydantic's findings in the words of a study file."""
    section, *rest = (str(part) for part in error["loc"])
    if section in ("trials", "sampling"):
        rest = []  # which of its forms was tried
    key = section if not rest else f"[{section}] {rest[0]}"
    value: Any = table.get(section)
    if rest and isinstance(value, dict):
        value = value.get(rest[0])
    if error["type"] == "missing":
        problems.add(key, None, MISSING[section])
    elif error["type"] == "extra_forbidden":
        of = TitleBlock if rest else Document
        allowed = allowed_names(rest[0] if rest else section, of.model_fields)
        problems.add(key, None, f"a study has no such key; {allowed}")
    else:
        problem = (key, value, EXPECTED[section])
        already = f"{key} = "
        if not any(found.startswith(already) for found in problems.found):
            problems.add(*problem)
