"""A view on the screen, or in a file."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tolstat.answers.pages import check_view_ending, save_view
from tolstat.answers.views.machine_view import view_of
from tolstat.cli.showing import print_table, screen
from tolstat.model.checked import offers
from tolstat.model.view import Listing
from tolstat.render.view_table import view_rows
from tolstat.study.study import load

MOST_ROWS, MOST_COLUMNS = 40, 7  # on the screen


def show_view(path: Path, name: str, output: Path | None) -> None:
    """Show what the machine of a study can show: in a file, or on the screen."""
    if output:
        check_view_ending(output)
    study = load(path)
    nominal = np.zeros((1, len(study.description.contributors)))
    view = view_of(study.model, study.settings, name, nominal, study)
    title, sentence = f"{study.title}: {name}", offers(study.model)[name].sentence
    if output:
        save_view(view, output, title, sentence)
    console = screen()
    if output:
        console.print(f"written to {output}")
        return
    heads, rows = view_rows(view)
    chosen = np.unique(np.linspace(0, len(rows) - 1, MOST_ROWS).astype(int))
    if isinstance(view, Listing):  # its first rows are those that matter
        chosen = np.arange(MOST_ROWS)
    shown = [rows[i] for i in chosen if i < len(rows)]
    cells = [list(row[:MOST_COLUMNS]) for row in shown]
    print_table(title, heads[:MOST_COLUMNS], cells, wide=True)
    if len(shown) < len(rows) or len(heads) > MOST_COLUMNS:
        there = f"{len(shown)} of {len(rows)} rows, {len(cells[0])} of {len(heads)}"
        console.print(f"{there} columns; all of them with -o FILE.csv")
