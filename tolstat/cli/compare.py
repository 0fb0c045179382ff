"""tolstat compare: runs compared with the first of them."""

from __future__ import annotations

from pathlib import Path

import click

from tolstat.answers.compare.compare_runs import compare as ask
from tolstat.cli.options import (
    check_delivery,
    closely,
    deliver,
    form,
    output_option,
    path_argument,
)


@click.command()
@path_argument("runs", "A.h5 B.h5...", nargs=-1, required=True)
@output_option("Also into a file: .html, .csv or .json.")
@form
@closely
def compare(
    runs: tuple[Path, ...],
    output: Path | None,
    form: str | None,
    responses: tuple[str, ...],
) -> None:
    """Compare runs, each with the first: B less A.

    Trial by trial where both have the same trials, or common random numbers: the same
    seed, sampling and, of a Latin hypercube, number of trials.
    """
    if len(runs) < 2:
        raise click.UsageError("A.h5 B.h5...: two runs or more are compared")
    check_delivery(output, form)
    deliver(ask(*runs, responses=responses), output, form)
