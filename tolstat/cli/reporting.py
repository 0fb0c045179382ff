"""Reports written: a page, and the same numbers for other tools."""

from __future__ import annotations

import gc
from collections.abc import Sequence
from pathlib import Path

import click

from tolstat.answers import pages as making
from tolstat.answers.report.ask import report
from tolstat.cli.typed_entries import limits_in
from tolstat.errors import PictureError
from tolstat.literal import visible
from tolstat.render.output_file import check_output
from tolstat.store.open_run import open as open_run


def report_run(
    path: Path,
    output: Path | None,
    form: str,
    responses: Sequence[str],
    limits: tuple[str, ...],
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
        from tolstat.cli.what_if import fresh_run_advice

        try:
            run = limited(run, limits_in(limits))
        except PictureError as error:
            advice = fresh_run_advice(path, (), limits)
            raise PictureError(f"{error}{advice}") from None
    found = report(run, responses)
    if form == "html":
        path = found.save(output or run.path.with_suffix(".html"))
        click.echo(f"report in {visible(str(path))}")
    elif output:
        making.write(output, found.json() if form == "json" else found.csv())
    else:
        click.echo(found.json() if form == "json" else found.csv(), nl=False)
