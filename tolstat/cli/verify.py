"""Checks of a stored run, and of the installation."""

import sys
from pathlib import Path

import click

from tolstat.answers.examined_model import Health, examined
from tolstat.answers.verification_document import (
    check_document,
    surroundings_document,
    verified_document,
)
from tolstat.cli.options import isolate, run_file, workers
from tolstat.execution import self_check
from tolstat.execution.verification import verify as verify_run
from tolstat.render.screen import show

EXIT_CODES = {Health.GOOD: 0, Health.NO_AUDIT: 1, Health.UNHEALTHY: 3}


@click.command()
@run_file
@click.option("--all", "all_trials", is_flag=True, help="Evaluate all trials again.")
@workers
@isolate
def verify(source: Path, all_trials: bool, workers: int | None) -> None:
    """Check whether a run is as it was written, and list the damage.

    It compares the checksum of every trial, samples all deviations again, and evaluates
    one trial in a hundred again. Exit code 1 if anything is not as stored.
    """
    result = verify_run(source, every=all_trials, workers=workers)
    show(verified_document(source, result))
    if not result.whole:
        sys.exit(1)


@click.command()
@click.argument(
    "source", metavar="[MODEL|STUDY.toml|FILE.py:NAME|FILE.fmu]", required=False
)
@isolate
def doctor(source: str | None) -> None:
    """Check the installation, or the integration of a model.

    It shows versions, processor, cores, stored compiled code and trials per second.
    Exit code 1 if the same trials have different responses. Of a model it shows what
    demands the steps of a few trials, their errors, and the scale of each state. Exit
    code 1 if the audit of a run would fail, else 3 if an answer depends on its block, a
    trial fails, or errors are far above rtol.
    """
    if source:
        document, health = examined(source)
        show(document)
        sys.exit(EXIT_CODES[health])
    show(surroundings_document(self_check.environment()))
    repeated = self_check.repeated_trials()
    show(check_document(repeated))
    if not repeated.same:
        sys.exit(1)
