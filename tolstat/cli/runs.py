"""The runs of a folder."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from tolstat.answers.index.run_entries import stored_runs
from tolstat.cli.options import path_argument
from tolstat.render.screen import show


@click.command()
@path_argument("folder", default=".")
def runs(folder: Path) -> None:
    """List the runs that are stored in FOLDER, and in the folders in it.

    Exit code 1 if one of them is damaged or no run.
    """
    found = stored_runs(folder)
    show(found.document())
    if any(each.problem for each in found.entries):
        sys.exit(1)
