"""What tolstat runs on here."""

from __future__ import annotations

import sys

import click

from tolstat.answers.computer import check_document, surroundings_document
from tolstat.execution.self_check import check, surroundings
from tolstat.render.screen import show


@click.command()
def doctor() -> None:
    """Say what tolstat runs on here, and whether it computes as it should.

    Versions, processor, cores, compiled code that is kept, and how many trials a
    second it does. Exit code 1 if the same trials have different responses.
    """
    show(surroundings_document(surroundings()))
    found = check()
    show(check_document(found))
    if not found.same:
        sys.exit(1)
