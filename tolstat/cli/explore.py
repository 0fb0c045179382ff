"""tolstat explore: a page on which the entries of a run are moved."""

from pathlib import Path

import click

from tolstat.answers.explore.explore_page import explore as explored
from tolstat.answers.output_file import check_output
from tolstat.cli import options
from tolstat.store.open_run import open as open_run


@click.command()
@options.run_file
@options.output_option(
    "The page to write; default: the run's name ending in .explore.html.",
    metavar="PAGE.html",
)
def explore(source: Path, output: Path | None) -> None:
    """Write a page to move tolerances, shifts and limits of a run.

    It is one file for a browser, and needs neither tolstat nor a network. It shows the
    fraction out of limit at each move, and the command that proves a scenario.
    """
    if output:
        check_output(output)
    run = open_run(source)
    page = explored(run).save(output or run.path.with_suffix(".explore.html"))
    options.say(f"page in {page}")
