"""Reports written: a page, and the same numbers for other tools."""

from __future__ import annotations

import gc
import re
import tomllib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, TypeVar

import click

from tolstat.answers import pages as making
from tolstat.answers.report.ask import report
from tolstat.errors import StudyError
from tolstat.literal import visible
from tolstat.render.output_file import check_output
from tolstat.render.plain import as_json
from tolstat.store.open_run import open as open_run

Found = TypeVar("Found")
NAMED = re.compile(r"\s*([^\W\d]\w*)\s*(\W.*?)\s*", re.DOTALL)


def report_run(
    path: Path,
    output: Path | None,
    form: str,
    responses: Sequence[str],
    limits: Sequence[str],
) -> None:
    """Write the report of a run.

    A page (`form` "html") lies beside the run if no file is given; "json" and "csv" go
    to the standard output then.
    """
    # the process ends with the page: what is left over needs no collecting
    gc.disable()
    if output:
        check_output(output)
    run = open_run(path)
    if limits:
        from tolstat.answers.relimit import limited

        run = limited(run, limits_in(limits))
    found = report(run, responses)
    if form == "html":
        path = found.save(output or run.path.with_suffix(".html"))
        click.echo(f"report in {visible(str(path))}")
    elif output:
        making.write(output, found.json() if form == "json" else found.csv())
    else:
        click.echo(found.json() if form == "json" else found.csv(), nl=False)


def limits_in(texts: Sequence[str]) -> dict[str, Any]:
    """Read limits as they are typed: "NAME <= 120 kN", or NAME = { ... } as in TOML."""
    found: dict[str, Any] = {}
    for text in texts:
        named = NAMED.fullmatch(text)
        if not named:
            raise StudyError(f'--limit "{text}": such as "rod_force <= 120 kN"')
        if named[1] in found:
            raise StudyError(f'--limit "{text}": {named[1]} stands there already')
        rest = named[2].strip()
        found[named[1]] = value_in(rest[1:], text) if rest[0] == "=" else rest
    return found


def value_in(value: str, text: str) -> Any:
    """Read a value as it is typed: as of TOML in braces or quotes, else a text."""
    value = value.strip()
    if value[:1] not in ("{", '"', "'"):
        return value
    try:
        return tomllib.loads(f"value = {value}")["value"]
    except (ValueError, RecursionError) as error:
        raise StudyError(f"{text}: {error}") from None


def deliver(
    found: Found, output: Path | None, form: str, as_csv: Callable[[Found], str]
) -> None:
    """Write findings as JSON or CSV, to a file or the standard output."""
    text = as_json(found) if form == "json" else as_csv(found)
    if output:
        making.write(output, text)
    else:
        click.echo(text, nl=False)
