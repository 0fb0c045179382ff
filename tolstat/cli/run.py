"""Run a study; resume or extend its run."""

from functools import partial
from pathlib import Path

import click

from tolstat.cli import options
from tolstat.cli.progress import watch
from tolstat.execution.execute import execute, go_on
from tolstat.render.screen import Screen
from tolstat.study.study import load


@click.command()
@options.path_argument("study")
@click.option("--trials", type=options.COUNT, help="Replaces that of the study.")
@click.option("--seed", type=click.IntRange(min=0), help="Replaces that of the study.")
@options.computing
@options.output_option("Run file; default: the study's name ending in .h5.")
@options.force(
    "Replace an existing run file, which stays until the new one is complete."
)
@options.checking
def run(
    study: Path,
    trials: int | None,
    seed: int | None,
    compute: options.Compute,
    output: Path | None,
    force: bool,
    check: bool,
) -> None:
    """Run the study STUDY.toml and store it in an HDF5 file.

    Ctrl-C stops within two seconds. Finished trials are stored; `tolstat resume`
    continues the run.
    """
    loaded = load(study, trials=trials, seed=seed)
    path = output or study.with_suffix(".h5")
    if check:
        from tolstat.cli.check import require_limits

        require_limits(study, loaded.limits)
    for warning in loaded.warnings:
        Screen(stderr=True).say(f"note: {warning}")
    work = partial(execute, loaded, path, force=force)
    watch(path, compute, work, check=check)


@click.command()
@options.run_file
@options.computing
@click.option(
    "--rerun-failed",
    "rerun",
    is_flag=True,
    help="Evaluate failed trials again with tighter settings, stored separately.",
)
@options.regardless
@options.checking
def resume(
    source: Path, compute: options.Compute, rerun: bool, regardless: bool, check: bool
) -> None:
    """Finish an interrupted run, and repair a damaged one.

    The result is, bit for bit, that of an uninterrupted run.
    """
    work = partial(go_on, source, rerun=rerun, regardless=regardless)
    watch(source, compute, work, check=check)


@click.command()
@options.run_file
@click.option(
    "--trials",
    type=options.COUNT,
    required=True,
    help="Number of trials in all.",
)
@options.computing
@options.regardless
@options.checking
def extend(
    source: Path, trials: int, compute: options.Compute, regardless: bool, check: bool
) -> None:
    """Add trials to a run of random or Sobol' sampling.

    The result is, bit for bit, that of one run with all trials.
    """
    work = partial(go_on, source, trials=trials, regardless=regardless)
    watch(source, compute, work, check=check)
