"""The models that there are."""

from __future__ import annotations

import click

from tolstat.answers.model_sheet import models_document
from tolstat.render.screen import show


@click.command()
def models() -> None:
    """List the models: tolstat's own, of installed packages, and --machine's."""
    show(models_document())
