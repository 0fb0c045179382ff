"""A view as a document, and in a file: a picture, a table of numbers, a page."""

from pathlib import Path
from typing import Any

import numpy as np

from tolstat.answers.output_file import as_pictures, save
from tolstat.document.blocks import Document, Figure, Table, paragraph, table_of
from tolstat.document.sentences import counted, say
from tolstat.document.view_content import plot_of, view_columns, view_table
from tolstat.model.view import Chart, View
from tolstat.render.serialize import csv_text

VIEWS = (".png", ".svg", ".pdf", ".csv", ".html")
MOST_ROWS, MOST_COLUMNS = 40, 7  # on the screen


def view_document(view: View, title: str, sentence: str = "") -> Document:
    """Return a view as a page shows it: a chart as a figure, a listing as a table."""
    lead = [paragraph(sentence)] if sentence else []
    if isinstance(view, Chart):
        figure = Figure(sentence or title, plot_of(view), wide=True)
        return Document(title, (*lead, figure))
    return Document(title, (*lead, _filled(view_table(view))))


def view_on_screen(view: View, title: str) -> Document:
    """Return some rows of a view; of a listing the first, most important ones."""
    table = view_table(view)
    rows, columns = table.rows, table.columns
    chosen = np.arange(min(MOST_ROWS, len(rows)))
    if isinstance(view, Chart):
        chosen = np.unique(np.linspace(0, len(rows) - 1, MOST_ROWS).astype(int))
    heads = columns[:MOST_COLUMNS]
    part = Table(heads, tuple(rows[i][:MOST_COLUMNS] for i in chosen))
    if len(chosen) == len(rows) and heads == columns:
        return Document(title, (_filled(part),))
    rest = say(
        "{} of {}, {} of {}; -o FILE.csv writes all of them",
        f"{len(chosen)}", counted(len(rows), "row"),
        f"{len(heads)}", counted(len(columns), "column"),
    )  # fmt: skip
    return Document(title, (_filled(part), paragraph(rest)))


def _filled(table: Table) -> Table:
    """Return a table without empty columns."""
    heads = [column.head for column in table.columns]
    return table_of(dict(zip(heads, row, strict=True)) for row in table.rows)


def as_csv(view: View) -> str:
    """Return a view as CSV, all figures, in the units that its heads name."""
    heads, values = list[str](), []
    for name, column, scale in view_columns(view):
        heads.append(f"{name} [{scale.mark}]" if scale and scale.mark else name)
        factor = scale.factor if scale else 1.0
        cells = column.tolist()
        values.append(cells if factor == 1.0 else [factor * cell for cell in cells])
    return csv_text(heads, zip(*values, strict=True))


def draw_view(view: View, title: str) -> Any:
    """Return a view as a figure of matplotlib: a chart in panels, or a table."""
    from tolstat.render.figures import draw

    return draw(plot_of(view) if isinstance(view, Chart) else view_table(view), title)


def save_view(view: View, path: Path, title: str, sentence: str = "") -> None:
    """Write a view: as a picture, a table of numbers, or a page, by the file's ending.

    Raises
    ------
    RunFileError
        If the ending is another, or it cannot be written.
    """

    def html() -> str:
        from tolstat.render.page import page  # seldom needed

        return page(view_document(view, title, sentence))

    pictures = as_pictures(lambda: draw_view(view, title))
    save(path, "a view", {**pictures, ".csv": lambda: as_csv(view), ".html": html})
