"""Trials added to a run."""

from __future__ import annotations

from pathlib import Path

import click

from tolstat.cli.compute_options import Compute, computing
from tolstat.cli.options import regardless, run_file
from tolstat.cli.progress import watch
from tolstat.execution.continuation import go_on
from tolstat.execution.run_loop import Telling
from tolstat.execution.workers.crew import Workers
from tolstat.store.stored_run import Run


@click.command()
@run_file
@click.option(
    "--trials",
    type=click.IntRange(min=1),
    required=True,
    help="How many there are to be in all.",
)
@computing
@regardless
def extend(source: Path, trials: int, compute: Compute, regardless: bool) -> None:
    """Add trials to a run of random or Sobol' sampling.

    It becomes, bit for bit, one run of so many trials.
    """

    def work(crew: Workers, tell: Telling) -> Run:
        return go_on(source, crew, trials=trials, regardless=regardless, progress=tell)

    watch(source, compute, work)
