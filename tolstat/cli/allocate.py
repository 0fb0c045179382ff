"""tolstat allocate: the cheapest tolerances that meet all limits of a study."""

from __future__ import annotations

import signal
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path

import click

from tolstat.answers.allocate.allocate_tolerances import allocated
from tolstat.answers.allocate.allocation import CHART, Allocation
from tolstat.answers.next_steps import command
from tolstat.answers.views.view_file import check_view_ending, save_view
from tolstat.catalogue import place_of
from tolstat.cli.interrupting import LIMITS_NOT_MET, leave, stop_on_interrupt
from tolstat.cli.options import (
    COUNT,
    Compute,
    computing,
    deliver,
    force,
    form,
    output_option,
    path_argument,
    plot_option,
)
from tolstat.cli.progress import ProgressBar
from tolstat.errors import RunFileError, StudyError
from tolstat.execution.workers.crew import Interrupted
from tolstat.literal import visible
from tolstat.render.output_file import check_folder, replace
from tolstat.study.study import Study, load


@click.command()
@path_argument("study", "STUDY.toml")
@click.option(
    "--trials",
    type=COUNT,
    help="Of the wide run, and of each proof; as many as the limits need if not given.",
)
@computing
@output_option("Write the study with the tolerances found: a .toml file.")
@plot_option("Cost over ppm: a .png, .svg, .pdf, .csv or .html file.")
@form
@force("Replace an existing file of -o.")
def allocate(
    study: Path,
    trials: int | None,
    compute: Compute,
    output: Path | None,
    plot: Path | None,
    form: str | None,
    force: bool,
) -> None:
    """Find the cheapest tolerances with which STUDY.toml meets its limits.

    Its entries of [deviations] say what they cost by tolerance. A fresh run proves what
    is found; where nothing meets the limits the exit code is 3.
    """
    asked = load(study)
    if output:
        _check_output(output, asked, force=force)
    if plot:
        check_view_ending(plot)
    with stop_on_interrupt() as stop:
        found = _allocated(asked, compute, trials, stop.is_set)
        # from here on Ctrl-C waits until whole files are written
        by, proved = _commands(asked, found, trials, output)
        if output and found.met:
            replace(output, found.study_file(by, proved).encode())
        if plot:
            save_view(found.chart, plot, f"{asked.title}: cost over ppm", CHART)
        deliver(found, None, form)
        if not form:
            _say_what_is_written(found, output, plot, proved)
    if not found.met:
        sys.exit(LIMITS_NOT_MET)


def _allocated(
    study: Study, compute: Compute, trials: int | None, stopping: Callable[[], bool]
) -> Allocation:
    """Allocate, and show how far that is; Ctrl-C ends the process."""
    try:
        with ProgressBar("trials") as bar, compute.crew(stopping) as crew:
            return allocated(study, crew, trials=trials, progress=bar.tell)
    except Interrupted:
        leave(signal.SIGINT, None)
        raise


def _commands(
    study: Study, found: Allocation, trials: int | None, output: Path | None
) -> tuple[str, str]:
    """Return what finds the tolerances again, and what proves them."""
    machine, proof = place_of(study.model), found.proof
    options = ["--trials", trials] if trials else []
    by = command("allocate", study.path, *options, machine=machine)
    if not (output and found.reproducible):
        return visible(by), ""
    options = ["--trials", proof.trials, "--seed", proof.seed]
    return visible(by), visible(command("run", output, *options, machine=machine))


def _say_what_is_written(
    found: Allocation, output: Path | None, plot: Path | None, proved: str
) -> None:

    if output and found.met:
        again = f"; the proof again: {proved}" if proved else ""
        click.echo(f"written to {visible(str(output))}{again}")
    elif output:
        click.echo(f"{visible(str(output))} is not written: limits are not met")
    if plot:
        click.echo(f"drawn in {visible(str(plot))}")


def _check_output(output: Path, study: Study, *, force: bool) -> None:
    """Refuse a file that the study cannot be written to, before anything runs."""
    check_folder(output)
    if output.suffix != ".toml":
        raise RunFileError(f"{output}: a study ends in .toml")
    assert study.path
    itself = output.resolve() == study.path.resolve()
    if output.exists() and (itself or not force):
        other = "it is the study itself" if force else "give another name"
        raise RunFileError(
            f"{output} exists already; {other}, or replace it by --force"
        )
    reason, table = "", tomllib.loads(study.text)
    try:
        there = load(table, model=study.model, folder=output.parent)
        if there.deviating.notes != study.deviating.notes:
            reason = "data of that name differ there"
    except StudyError as error:
        reason = str(error)
    if reason:
        raise RunFileError(
            f"{output} would not be this study, which reads files of its own folder: "
            f"{reason}; write it beside {study.path}, or copy them there first"
        )
