"""Runs and models on the screen."""

from __future__ import annotations

from pathlib import Path

import click

from tolstat.answers.model_sheet import model_document
from tolstat.answers.report.ask import summary
from tolstat.answers.sweep.reference_tables import comparisons
from tolstat.answers.sweep.sweep_figure import save_sweeps
from tolstat.answers.sweep.table_rows import table_rows
from tolstat.cli.follow import follow_run
from tolstat.cli.options import plot_option
from tolstat.document.blocks import Document
from tolstat.render import screen
from tolstat.store.open_run import open as open_run


@click.command()
@click.argument("what", metavar="RUN.h5...|MODEL", nargs=-1, required=True)
@plot_option("Draw grid runs as curves: a .png, .svg or .pdf file.")
@click.option(
    "--response",
    "responses",
    multiple=True,
    help="What to draw; what has a limit if not given. May be repeated.",
)
@click.option("--follow", is_flag=True, help="Follow a run while it is being written.")
def show(
    what: tuple[str, ...], plot: Path | None, responses: tuple[str, ...], follow: bool
) -> None:
    """Show the summary of stored runs, or what a model is given and answers."""
    if responses and not plot:
        raise click.UsageError("--response belongs to --plot")
    if follow and (plot or len(what) > 1):
        raise click.UsageError("--follow takes one run, and draws nothing")
    if follow:
        follow_run(Path(what[0]))
    if plot:
        runs = [open_run(Path(each)) for each in what]
        save_sweeps(runs, plot, responses)
        for run in runs:
            screen.show(Document("", tuple(comparisons(run))))
        screen.screen().print(f"drawn in {plot}")
        return
    for each in what:
        if each.endswith((".h5", ".toml")) or Path(each).is_file():
            run = open_run(Path(each))
            screen.show(summary(run).document())
            screen.show(Document("", (*table_rows(run), *comparisons(run))))
        else:
            screen.show(model_document(each))
