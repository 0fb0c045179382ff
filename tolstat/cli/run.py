"""Run a study; resume or extend its run."""

import sys
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path

import click

from tolstat.answers.next_steps import to_resume
from tolstat.answers.reports import summary
from tolstat.cli import options
from tolstat.cli.entry import leave_interrupted, stop_on_interrupt
from tolstat.cli.progress import ProgressBar
from tolstat.execution.execute import execute, go_on
from tolstat.literal import visible
from tolstat.render.screen import Screen, show
from tolstat.store.stored_run import Run
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
    crew: options.Crew,
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
    _watch(path, crew, work, check=check)


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
    source: Path, crew: options.Crew, rerun: bool, regardless: bool, check: bool
) -> None:
    """Finish an interrupted run, and repair a damaged one.

    The result is, bit for bit, that of an uninterrupted run.
    """
    work = partial(go_on, source, rerun=rerun, regardless=regardless)
    _watch(source, crew, work, check=check)


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
    source: Path, trials: int, crew: options.Crew, regardless: bool, check: bool
) -> None:
    """Add trials to a run of random or Sobol' sampling.

    The result is, bit for bit, that of one run with all trials.
    """
    work = partial(go_on, source, trials=trials, regardless=regardless)
    _watch(source, crew, work, check=check)


def _watch(
    path: Path, crew: options.Crew, work: Callable[..., Run], *, check: bool
) -> None:
    """Work on a run, show its progress and its summary; with `check` end as that."""
    console = Screen(stderr=True)
    words = f"stopped: what is stored is in {visible(str(path))}; "
    with stop_on_interrupt(f"{words}`tolstat resume` completes it") as stop:
        with ProgressBar(path.stem) as bar, crew(stop.is_set) as workers:
            done = work(workers, progress=bar.tell)
        if not done.complete:
            with suppress(OSError):  # the terminal may be gone
                stored = f"{done.ended} of {done.trials} trials are stored"
                words = f"stopped: {stored} in {done.path}; continue with:"
                console.say(words)
                console.type(to_resume(done.path, done.machine))
            leave_interrupted()
        show(summary(done).document())
        seconds = done.provenance["seconds"]
        rate = f"{done.trials / seconds:.0f} trials/s"
        stored = f"stored in {done.path}"
        console.say(f"{done.trials} trials in {seconds:.1f} s ({rate}), {stored}")
        if check:
            from tolstat.cli.check import checked

            sys.exit(checked([done]).exit_code)
