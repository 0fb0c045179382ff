"""A run finished and repaired."""

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
@computing
@click.option(
    "--rerun-failed",
    is_flag=True,
    help="Evaluate failed trials again with tighter settings, and keep that apart.",
)
@regardless
def resume(
    source: Path, compute: Compute, rerun_failed: bool, regardless: bool
) -> None:
    """Finish what is missing of a run, and repair what is damaged.

    It becomes, bit for bit, the run that was never interrupted.
    """

    def work(crew: Workers, tell: Telling) -> Run:
        return go_on(
            source, crew, rerun=rerun_failed, regardless=regardless, progress=tell
        )

    watch(source, compute, work)
