"""tolstat allocate: the cheapest tolerances that meet all limits of a study."""

import signal
import sys
import tomllib
from pathlib import Path

import click

from tolstat.answers.allocate.allocate_tolerances import allocated
from tolstat.answers.allocate.allocation_document import CHART, chart_of
from tolstat.answers.next_steps import command
from tolstat.answers.output_file import check_ending, replace
from tolstat.answers.views.view_file import VIEWS, save_view
from tolstat.answers.what_if.fresh_study import study_in
from tolstat.catalogue import place_of
from tolstat.cli import options
from tolstat.cli.entry import LIMITS_NOT_MET, leave, stop_on_interrupt
from tolstat.cli.progress import ProgressBar
from tolstat.errors import Advice, Remedy, RunFileError
from tolstat.execution.workers.block_scheduler import Interrupted
from tolstat.literal import visible
from tolstat.study.study import Study, load


@click.command()
@options.path_argument("study", "STUDY.toml")
@click.option(
    "--trials",
    type=options.COUNT,
    help="Trials of the wide run and of each proof; default: as many as limits need.",
)
@options.computing
@options.output_option("Write the study with the tolerances found: a .toml file.")
@options.plot_option("Cost over ppm: a .png, .svg, .pdf, .csv or .html file.")
@options.form
@options.force("Replace an existing output file.")
def allocate(
    study: Path,
    trials: int | None,
    crew: options.Crew,
    output: Path | None,
    plot: Path | None,
    form: str | None,
    force: bool,
) -> None:
    """Find the cheapest tolerances that meet the limits of STUDY.toml.

    Entries of [deviations] give costs by tolerance. A fresh run proves the result. The
    exit code is 3 if no tolerances meet the limits.
    """
    loaded = load(study)
    if output:
        _check_output(output, loaded, force=force)
    if plot:
        check_ending(plot, "a view", VIEWS)
    with stop_on_interrupt() as stop:
        try:
            with ProgressBar("trials") as bar, crew(stop.is_set) as workers:
                allocation = allocated(
                    loaded, workers, trials=trials, progress=bar.tell
                )
        except Interrupted:
            leave(signal.SIGINT, None)
            raise
        # from here on Ctrl-C waits until whole files are written
        proved = ""
        if output and allocation.met:
            machine = place_of(loaded.model)
            typed = ["--trials", trials] if trials else []
            by = visible(command("allocate", study, *typed, machine=machine).text)
            proved = visible(command("run", output, machine=machine).text)
            replace(output, allocation.study_file(by, proved).encode())
        if plot:
            title = f"{loaded.title}: cost over ppm"
            save_view(chart_of(allocation), plot, title, CHART)
        options.Delivery(None, form, "").deliver(allocation)
    if output and not form:
        written = f"written to {output}; repeat the proof: {proved}"
        missed = f"{output} is not written: limits are not met"
        options.say(written if allocation.met else missed)
    if plot and not form:
        options.say(f"picture in {plot}")
    if not allocation.met:
        sys.exit(LIMITS_NOT_MET)


def _check_output(output: Path, study: Study, *, force: bool) -> None:
    """Refuse an output file that cannot be written, before anything runs."""
    options.check_study_output(output)
    assert study.path
    if output.exists() and output.samefile(study.path):
        raise RunFileError(f"{output} is the study itself; give another name")
    if output.exists() and not force:
        raise RunFileError(f"{output} exists already", Advice(Remedy.REPLACE))
    table = tomllib.loads(study.text)
    study_in(output.parent, table, study.model, study.deviating, study.path)
