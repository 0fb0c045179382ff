"""The trials of a run for other programs."""

from __future__ import annotations

from pathlib import Path

import click

from tolstat.answers.trial_export import export as write_trials
from tolstat.cli.options import output_option, run_file
from tolstat.literal import visible
from tolstat.store.open_run import open as open_run


@click.command()
@run_file
@output_option("The table.", metavar="FILE.csv|.parquet", required=True)
@click.option("--force", is_flag=True, help="Replace an existing file.")
def export(source: Path, output: Path, force: bool) -> None:
    """Write the trials of a run as a table: a row for each, units in the heads, SI."""
    run = open_run(source)
    write_trials(run, output, force=force)
    click.echo(f"{run.trials} trials in {visible(str(output))}")
