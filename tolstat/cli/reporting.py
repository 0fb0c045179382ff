"""Reports written: a page, and the same numbers for other tools."""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import click

from tolstat.cli.running import leave_on_interrupt
from tolstat.cli.showing import screen
from tolstat.errors import RunFileError
from tolstat.report.findings import findings_of, reportable
from tolstat.report.further import with_evidence
from tolstat.store.run import open as open_run

HEADS = ("path", "value", "lower", "upper", "reason")


def report_run(
    path: Path, output: Path | None, form: str, responses: Sequence[str]
) -> None:
    """Write the report of a run.

    Parameters
    ----------
    path : Path
        The run.
    output : Path, optional
        Where to; beside the run, ending in .html, if not given. JSON and CSV go to the
        standard output if not given.
    form : str
        "html", "json" or "csv".
    responses : sequence of str
        What is looked at closely; what has a limit if none are given.
    """
    from tolstat.study.evidence import gather

    if path.suffix == ".toml":
        raise RunFileError(f"{path} is a study; `tolstat run {path}` makes a run of it")
    run = open_run(path)
    # what is wrong is said before anything is simulated
    reportable(run, responses)
    target = output or path.with_suffix(".html")
    if not target.parent.is_dir():
        raise RunFileError(f"{target} cannot be written: there is no such folder")
    with leave_on_interrupt(), ThreadPoolExecutor(1) as executor:
        # simulates while findings are gathered and drawn
        evidence = executor.submit(gather, run)
        found = findings_of(run, responses)
        if form == "html":
            from tolstat.report.page import make_page, pictures_of

            drawn = pictures_of(run, found)
    found = with_evidence(found, run, evidence.result())
    if form == "html":
        write(target, make_page(run, found, drawn, evidence.result()))
        screen().print(f"report in {target}")
    else:
        deliver(found, output, form)


def deliver(found: dict[str, Any], output: Path | None, form: str) -> None:
    """Write findings as JSON or CSV, to a file or the standard output."""
    text = as_json(found) if form == "json" else as_csv(found)
    if output:
        write(output, text)
    else:
        click.echo(text, nl=False)


def write(path: Path, text: str) -> None:
    """Write a text file.

    Raises
    ------
    RunFileError
        If it cannot be written.
    """
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise RunFileError(f"{path} cannot be written: {error}") from error


def as_json(found: dict[str, Any]) -> str:
    """Write findings as JSON: what is infinite is the text "inf" or "-inf"."""
    return json.dumps(_finite(found), indent=1, allow_nan=False) + "\n"


def _finite(found: Any) -> Any:
    if isinstance(found, dict):
        return {key: _finite(value) for key, value in found.items()}
    if isinstance(found, list):
        return [_finite(value) for value in found]
    if isinstance(found, float) and math.isinf(found):
        return "inf" if found > 0 else "-inf"
    return found


def as_csv(found: dict[str, Any]) -> str:
    """Write all numbers of findings as CSV: a row for each, with its interval, SI."""
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(HEADS)
    writer.writerows(_rows(found, ()))
    return buffer.getvalue()


def _rows(found: Any, path: tuple[str, ...]) -> Iterator[tuple[Any, ...]]:
    if isinstance(found, dict) and set(found) == {"value", "lower", "upper", "reason"}:
        yield "/".join(path), *(found[key] for key in HEADS[1:])
    elif isinstance(found, dict):
        for key, value in found.items():
            yield from _rows(value, (*path, str(key)))
    elif isinstance(found, list):
        for index, value in enumerate(found):
            yield from _rows(value, (*path, str(index)))
    else:
        yield "/".join(path), found, None, None, ""
