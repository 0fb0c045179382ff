"""A run verified."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from tolstat.answers.verified import verified_document
from tolstat.cli.compute_options import workers
from tolstat.cli.options import run_file
from tolstat.execution import verification
from tolstat.render.screen import show


@click.command()
@run_file
@click.option("--all", "every", is_flag=True, help="Evaluate all trials again.")
@workers
def verify(source: Path, every: bool, workers: int | None) -> None:
    """Say whether a run is as it was written, and name what is damaged.

    The checksum of every trial is compared, all deviations are drawn again, and one
    trial of each hundred is evaluated again. Exit code 1 if anything is not as stored.
    """
    found = verification.verify(source, every=every, workers=workers)
    show(verified_document(source, found))
    if not found.whole:
        sys.exit(1)
