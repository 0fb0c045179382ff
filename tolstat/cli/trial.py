"""One trial simulated again."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from tolstat.answers.views.replay import nominal_trial, replay
from tolstat.answers.views.view_file import check_view_ending, save_view
from tolstat.cli.options import path_argument, plot_option
from tolstat.errors import ModelError
from tolstat.render.screen import screen, show
from tolstat.study.study import load


@click.command()
@path_argument("source", "RUN.h5|STUDY.toml")
@click.argument("index", type=click.IntRange(min=0), required=False)
@click.option("--nominal", is_flag=True, help="The trial without deviations.")
@plot_option("Its histories: a .png, .svg, .pdf, .csv or .html file.")
def trial(source: Path, index: int | None, nominal: bool, plot: Path | None) -> None:
    """Simulate one stored trial again, bit for bit, with its histories.

    Exit code 1 if it is not as stored.
    """
    if nominal == (index is not None):
        raise click.UsageError("give the number of a trial, or --nominal")
    if source.suffix == ".toml" and index is not None:
        raise click.UsageError(
            f"{source} is a study, and trials are in its run: "
            f"{source.with_suffix('.h5')}; or give --nominal"
        )
    if plot:
        check_view_ending(plot)
    if source.suffix == ".toml":
        found = nominal_trial(load(source))
    else:
        found = replay(source, index)
    show(found.document())
    if plot:
        if found.history is None:
            raise ModelError("this model does not move: it has no histories")
        save_view(found.history, plot, found.title)
        screen().print(f"drawn in {plot}")
    if found.differences:
        sys.exit(1)
