"""What a model can show."""

from __future__ import annotations

from pathlib import Path

import click
import numpy as np

from tolstat.answers.views.machine_view import view_of
from tolstat.answers.views.view_file import (
    check_view_ending,
    save_view,
    view_on_screen,
)
from tolstat.cli.options import output_option, path_argument
from tolstat.model.checked import offers
from tolstat.render.screen import screen, show
from tolstat.study.study import load


@click.command()
@path_argument("study", "STUDY.toml")
@click.argument("name")
@output_option(
    "A .png, .svg, .pdf, .csv or .html file; a table on the screen if not given."
)
def view(study: Path, name: str, output: Path | None) -> None:
    """Show what a model can show, by name; `tolstat show MODEL` lists the names.

    A frequency diagram, a stability chart, a catalogue of designs, a history: of the
    nominal trial of STUDY.toml, with the bands that its tolerances open.
    """
    if output:
        check_view_ending(output)
    asked = load(study)
    nominal = np.zeros((1, len(asked.description.contributors)))
    found = view_of(asked.model, asked.settings, name, nominal, asked)
    title = f"{asked.title}: {name}"
    if output:
        save_view(found, output, title, offers(asked.model)[name].sentence)
        screen().print(f"written to {output}")
    else:
        show(view_on_screen(found, title))
