"""Reports written: a page, and the same numbers for other tools."""

from __future__ import annotations

import gc
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click

from tolstat.literal import visible
from tolstat.reporting import making
from tolstat.reporting.gather import findings_of
from tolstat.reporting.plain import as_csv, as_json
from tolstat.store.opening import open as open_run


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
    # the process ends with the page: what is left over needs no collecting
    gc.disable()
    run = open_run(path)
    if form == "html":
        made = making.report(run, output, responses)
        click.echo(f"report in {visible(str(made))}")
    else:
        deliver(findings_of(run, responses), output, form)


def deliver(found: Any, output: Path | None, form: str) -> None:
    """Write findings as JSON or CSV, to a file or the standard output."""
    text = as_json(found) if form == "json" else as_csv(found)
    if output:
        making.write(output, text)
    else:
        click.echo(text, nl=False)
