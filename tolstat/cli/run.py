"""A study run."""

from __future__ import annotations

from pathlib import Path

import click

from tolstat.cli.compute_options import Compute, computing
from tolstat.cli.options import output_option, path_argument
from tolstat.cli.progress import watch
from tolstat.execution.execute import execute
from tolstat.execution.run_loop import Telling
from tolstat.execution.workers.crew import Workers
from tolstat.render.screen import Screen
from tolstat.store.stored_run import Run
from tolstat.study.study import load


@click.command()
@path_argument("study")
@click.option("--trials", type=click.IntRange(min=1), help="Instead of the study's.")
@click.option("--seed", type=click.IntRange(min=0), help="Instead of the study's.")
@computing
@output_option("Run file; beside the study, ending in .h5, if not given.")
@click.option(
    "--force",
    is_flag=True,
    help="Replace an existing run file, which stays until the new one is complete.",
)
def run(
    study: Path,
    trials: int | None,
    seed: int | None,
    compute: Compute,
    output: Path | None,
    force: bool,
) -> None:
    """Run the study STUDY.toml and store it in an HDF5 file.

    Ctrl-C stops within two seconds. What is finished by then is stored, and `tolstat
    resume` continues it.
    """
    asked = load(study, trials=trials, seed=seed)
    path = output or study.with_suffix(".h5")
    for each in asked.doubts:
        Screen(stderr=True).print(f"note: {each}", soft_wrap=True)

    def work(crew: Workers, tell: Telling) -> Run:
        return execute(asked, path, crew, force=force, progress=tell)

    watch(path, compute, work)
