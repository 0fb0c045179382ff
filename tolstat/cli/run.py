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
from tolstat.execution.execute import STUDY_ENDING, execute, go_on
from tolstat.literal import visible
from tolstat.render.screen import Screen, show
from tolstat.store.stored_run import Run
from tolstat.study.sampling import deciding
from tolstat.study.study import Study, load


@click.command()
@options.path_argument("study")
@click.option("--trials", type=options.COUNT, help="Replaces that of the study.")
@click.option("--seed", type=click.IntRange(min=0), help="Replaces that of the study.")
@options.flag(
    "Run until every limit is met or not met, as `tolstat decide`.",
    "--decide", "decided",
)  # fmt: skip
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
    decided: bool,
    crew: options.Crew,
    output: Path | None,
    force: bool,
    check: bool,
) -> None:
    """Run the study STUDY.toml and store it in an HDF5 file.

    Ctrl-C stops within two seconds. Finished trials are stored; `tolstat resume`
    continues the run.
    """
    if decided and trials:
        raise click.UsageError("give --trials or --decide, not both")
    loaded = load(study, trials=deciding() if decided else trials, seed=seed)
    _run(loaded, output or study.with_suffix(".h5"), crew, force=force, check=check)


def _run(
    study: Study, path: Path, crew: options.Crew, *, force: bool, check: bool
) -> None:
    """Run a checked study; show its progress and its summary."""
    if check:
        from tolstat.cli.check import require_limits

        require_limits(study.path or path, study.limits)
    for warning in study.warnings:
        Screen(stderr=True).say(f"note: {warning}")
    work = partial(execute, study, path, force=force)
    _watch(path, crew, work, check=check)


@click.command()
@options.path_argument("source", "STUDY.toml|RUN.h5")
@click.option(
    "--at-most",
    metavar="N|TIME",
    help="Trials, or a time such as 60s, after which limits may stay undecided; "
    "default: 200000 trials, or more if these take less than a minute.",
)
@click.option(
    "--slow/--not-slow",
    default=None,
    help="Whether to evaluate mainly uncertain trials, of which fewer decide; "
    "default: by the kind of model, and of equations of motion by the trials needed.",
)
@options.computing
@options.output_option("Run file of a study; default: its name ending in .h5.")
@options.force("Replace an existing run file of a study.")
@options.regardless
@options.checking
def decide(
    source: Path,
    at_most: str | None,
    slow: bool | None,
    crew: options.Crew,
    output: Path | None,
    force: bool,
    regardless: bool,
    check: bool,
) -> None:
    """Run, or add trials, until every limit is met or not met.

    Takes a study or a run. Limits are looked at after every tenth of the trials. Each
    verdict is wrong in at most 2.5 % of runs, for any distribution. It needs random
    sampling.
    """
    most = int(at_most) if at_most and at_most.isdecimal() else at_most
    rule = deciding(most, slow)
    if source.suffix == STUDY_ENDING:
        path = output or source.with_suffix(".h5")
        _run(load(source, trials=rule), path, crew, force=force, check=check)
        return
    if output or force:
        raise click.UsageError("-o and --force are for studies; a run grows in place")
    work = partial(go_on, source, trials=rule, regardless=regardless)
    _watch(source, crew, work, check=check)


@click.command()
@options.run_file
@options.computing
@options.flag(
    "Evaluate failed trials again with tighter settings, stored separately.",
    "--rerun-failed", "rerun",
)  # fmt: skip
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
    "--trials", type=options.COUNT, required=True, help="Number of trials in all."
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
                stored = f"{done.progress} trials are stored"
                words = f"stopped: {stored} in {done.path}; continue with:"
                console.say(words)
                console.type(to_resume(done.path, done.machine).text)
            leave_interrupted()
        show(summary(done).document())
        seconds = done.provenance["seconds"]
        rate = f"{done.trials / seconds:.0f} trials/s"
        stored = f"stored in {done.path}"
        console.say(f"{done.trials} trials in {seconds:.1f} s ({rate}), {stored}")
        if check:
            from tolstat.cli.check import checked

            sys.exit(checked([done]).exit_code)
