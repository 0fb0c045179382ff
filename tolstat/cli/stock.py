"""Commands on many studies and runs: queued, and stored."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from tolstat.cli.options import output_option, path_argument, run_file
from tolstat.cli.power import Power, powered


@click.command()
@path_argument("studies", "STUDY.toml...", nargs=-1, required=True)
@powered
@output_option(
    "Where batch.html and batch.csv go; where the studies lie if not given.",
    metavar="FOLDER",
)
def batch(studies: tuple[Path, ...], power: Power, output: Path | None) -> None:
    """Run studies one after the other, each with all there is to evaluate it.

    Runs and reports lie beside their studies. What is finished is skipped, what was
    interrupted is gone on with, and what fails does not stop the others. The exit code
    is that of the first of these that happened: 1 something broke, 2 a study was
    refused, 3 a limit is not met.
    """
    from tolstat.cli.queueing import work_off_all

    sys.exit(work_off_all(studies, output, power))


@click.command()
@path_argument("folder", default=".")
def runs(folder: Path) -> None:
    """List the runs that are stored in FOLDER, and in the folders in it.

    Exit code 1 if one of them is damaged or no run.
    """
    from tolstat.cli.listing import list_runs

    if not list_runs(folder):
        sys.exit(1)


@click.command()
@run_file
@output_option("The table.", metavar="FILE.csv|.parquet", required=True)
@click.option("--force", is_flag=True, help="Replace an existing file.")
def export(source: Path, output: Path, force: bool) -> None:
    """Write the trials of a run as a table: a row for each, units in the heads, SI."""
    from tolstat.answers.export import export
    from tolstat.literal import visible
    from tolstat.store.open_run import open as open_run

    run = open_run(source)
    export(run, output, force=force)
    click.echo(f"{run.trials} trials in {visible(str(output))}")


@click.command()
def doctor() -> None:
    """Say what tolstat runs on here, and whether it computes as it should.

    Versions, processor, cores, compiled code that is kept, and how many machines a
    second it does. Exit code 1 if the same machines have different answers.
    """
    from tolstat.cli.examining import examine

    if not examine():
        sys.exit(1)
