"""tolstat compare: runs compared with the first of them."""

from __future__ import annotations

from pathlib import Path

import click

from tolstat.answers.compare.compare_runs import compare as ask
from tolstat.cli import options


@click.command()
@options.path_argument("runs", "A.h5 B.h5...", nargs=-1, required=True)
@options.output_option("Also into a file: .html, .csv or .json.")
@options.form
@options.closely
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
    options.check_delivery(output, form)
    options.deliver(ask(*runs, responses=responses), output, form)
