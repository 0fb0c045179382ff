"""The commands of tolstat. What a command needs it loads when it is called."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from tolstat.cli.allocate import allocate
from tolstat.cli.compare import compare
from tolstat.cli.group import EXIT_CODES, Group
from tolstat.cli.interrupting import LIMITS_NOT_MET
from tolstat.cli.options import (
    closely,
    form,
    limits,
    output_option,
    path_argument,
    plot_option,
    regardless,
    run_file,
)
from tolstat.cli.power import Power, powered, workers
from tolstat.cli.stock import batch, doctor, export, runs
from tolstat.cli.what_if import what_if


@click.group(
    cls=Group,
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog=EXIT_CODES,
)
@click.version_option(package_name="tolstat", prog_name="tolstat")
def main() -> None:
    """Monte Carlo tolerance analysis with the dynamics in the loop.

    A machine is built thousands of times on paper, each time with its own random
    manufacturing deviations; every one of them is simulated.
    """


@main.command()
@path_argument("study")
@click.option("--trials", type=click.IntRange(min=1), help="Instead of the study's.")
@click.option("--seed", type=click.IntRange(min=0), help="Instead of the study's.")
@powered
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
    power: Power,
    output: Path | None,
    force: bool,
) -> None:
    """Run the study STUDY.toml and store it in an HDF5 file.

    Ctrl-C stops within two seconds; what is finished by then is stored, and `tolstat
    resume` goes on with it.
    """
    from tolstat.cli.running import run_study
    from tolstat.study.study import load

    asked = load(study, trials=trials, seed=seed)
    path = output or study.with_suffix(".h5")
    _judge(run_study(asked, path, power, force=force))


def _judge(met: bool) -> None:
    """End with the exit code of limits that are not met."""
    if not met:
        sys.exit(LIMITS_NOT_MET)


@main.command()
@run_file
@powered
@click.option(
    "--rerun-failed",
    is_flag=True,
    help="Evaluate failed trials again with tighter settings, and keep that apart.",
)
@regardless
def resume(source: Path, power: Power, rerun_failed: bool, regardless: bool) -> None:
    """Finish what is missing of a run, and repair what is damaged.

    It becomes, bit for bit, the run that was never interrupted.
    """
    from tolstat.cli.running import go_on_with

    _judge(go_on_with(source, power, rerun=rerun_failed, regardless=regardless))


@main.command()
@run_file
@click.option(
    "--trials",
    type=click.IntRange(min=1),
    required=True,
    help="How many there are to be in all.",
)
@powered
@regardless
def extend(source: Path, trials: int, power: Power, regardless: bool) -> None:
    """Add trials to a run of random or Sobol' machines.

    It becomes, bit for bit, one run of so many trials.
    """
    from tolstat.cli.running import go_on_with

    _judge(go_on_with(source, power, trials=trials, regardless=regardless))


@main.command()
@run_file
@click.option("--all", "every", is_flag=True, help="Evaluate all trials again.")
@workers
def verify(source: Path, every: bool, workers: int | None) -> None:
    """Say whether a run is as it was written, and name what is damaged.

    The checksum of every trial is compared, all deviations are drawn again, and one
    trial of each hundred is evaluated again. Exit code 1 if anything is not as stored.
    """
    from tolstat.cli.verifying import verify_run

    if not verify_run(source, every=every, workers=workers):
        sys.exit(1)


@main.command()
@click.argument("what", metavar="RUN.h5...|MODEL", nargs=-1, required=True)
@plot_option("Draw grid runs as curves: a .png, .svg or .pdf file.")
@click.option(
    "--response",
    "responses",
    multiple=True,
    help="What to draw; what has a limit if not given. May be repeated.",
)
@click.option(
    "--follow", is_flag=True, help="Look on while a run is written, until it ends."
)
def show(
    what: tuple[str, ...], plot: Path | None, responses: tuple[str, ...], follow: bool
) -> None:
    """Show the summary of stored runs, or what a model can be asked."""
    from tolstat.cli.modelling import show_model
    from tolstat.cli.showing import plot_runs, show_run

    if responses and not plot:
        raise click.UsageError("--response belongs to --plot")
    if follow and (plot or len(what) > 1):
        raise click.UsageError("--follow looks on at one run, and draws nothing")
    if follow:
        from tolstat.cli.following import follow_run

        follow_run(Path(what[0]))
    if plot:
        plot_runs([Path(each) for each in what], plot, responses)
        return
    for each in what:
        if each.endswith((".h5", ".toml")) or Path(each).is_file():
            show_run(Path(each))
        else:
            show_model(each)


@main.command()
@path_argument("source", "RUN.h5|STUDY.toml")
@click.argument("index", type=click.IntRange(min=0), required=False)
@click.option("--nominal", is_flag=True, help="The machine without deviations.")
@plot_option("Its histories: a .png, .svg, .pdf, .csv or .html file.")
def trial(source: Path, index: int | None, nominal: bool, plot: Path | None) -> None:
    """Simulate one stored trial again, bit for bit, with its histories.

    Exit code 1 if it is not as stored.
    """
    from tolstat.cli.replaying import show_nominal, show_trial

    if nominal == (index is not None):
        raise click.UsageError("give the number of a trial, or --nominal")
    if source.suffix == ".toml":
        if index is not None:
            raise click.UsageError(
                f"{source} is a study, and trials are in its run: "
                f"{source.with_suffix('.h5')}; or give --nominal"
            )
        show_nominal(source, plot)
    elif not show_trial(source, index, plot):
        sys.exit(1)


@main.command()
@path_argument("study", "STUDY.toml")
@click.argument("name")
@output_option(
    "A .png, .svg, .pdf, .csv or .html file; a table on the screen if not given."
)
def view(study: Path, name: str, output: Path | None) -> None:
    """Show what a machine can show, by name; `tolstat show MODEL` lists the names.

    A frequency diagram, a stability chart, a catalogue of designs, a history: of the
    nominal machine of STUDY.toml, with the bands that its tolerances open.
    """
    from tolstat.cli.viewing import show_view

    show_view(study, name, output)


@main.command()
@run_file
@output_option("The page; beside the run, ending in .html, if not given.")
@form
@closely
@limits
def report(
    source: Path,
    output: Path | None,
    form: str | None,
    responses: tuple[str, ...],
    limits: tuple[str, ...],
) -> None:
    """Write the statistical tolerance report of a run: one page of HTML.

    With --json or --csv the numbers alone, to the screen or into the file of -o.
    """
    from tolstat.cli.reporting import report_run

    report_run(source, output, form or "html", responses, limits)


@main.command()
def models() -> None:
    """List the models: tolstat's own, of installed packages, and --machine's."""
    from tolstat.cli.modelling import list_models

    list_models()


for _command in (allocate, what_if, compare, batch, runs, export, doctor):
    main.add_command(_command)
