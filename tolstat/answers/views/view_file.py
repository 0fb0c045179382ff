"""A view as a document, and in a file: a picture, a table of numbers, a page."""

from pathlib import Path

import numpy as np

from tolstat.document.blocks import Block, Document, Figure, paragraph, table_of
from tolstat.document.inline import counted, say
from tolstat.errors import PictureError
from tolstat.model.view import Chart, View
from tolstat.render.output_file import check_ending, replace
from tolstat.render.shown_view import as_csv, view_rows

VIEWS = (".png", ".svg", ".pdf", ".csv", ".html")
MOST_ROWS, MOST_COLUMNS = 40, 7  # on the screen


def view_document(view: View, title: str, sentence: str = "") -> Document:
    """Return a view as a page shows it: a chart as a figure, a listing as a table."""
    said = [paragraph(sentence)] if sentence else []
    if isinstance(view, Chart):
        return Document(title, (*said, Figure(sentence or title, view, wide=True)))
    heads, rows = view_rows(view)
    table = table_of(dict(zip(heads, row, strict=True)) for row in rows)
    return Document(title, (*said, table))


def view_on_screen(view: View, title: str) -> Document:
    """Return some rows of a view; of a listing the first, most important ones."""
    heads, rows = view_rows(view)
    chosen = np.arange(min(MOST_ROWS, len(rows)))
    if isinstance(view, Chart):
        chosen = np.unique(np.linspace(0, len(rows) - 1, MOST_ROWS).astype(int))
    few = heads[:MOST_COLUMNS]
    table = table_of(dict(zip(few, rows[i], strict=False)) for i in chosen)
    blocks: list[Block] = [table]
    if len(chosen) < len(rows) or len(few) < len(heads):
        said = say(
            "{} of {}, {} of {}; -o FILE.csv writes all of them",
            f"{len(chosen)}", counted(len(rows), "row"),
            f"{len(few)}", counted(len(heads), "column"),
        )  # fmt: skip
        blocks.append(paragraph(said))
    return Document(title, tuple(blocks))


def save_view(view: View, path: Path, title: str, sentence: str = "") -> None:
    """Write a view: as a picture, a table of numbers, or a page, by the file's ending.

    Raises
    ------
    RunFileError, PictureError
        If the ending is another, or it cannot be written.
    """
    check_ending(path, "a view", VIEWS, PictureError)
    if path.suffix.lower() == ".csv":
        replace(path, as_csv(view).encode())
    elif path.suffix.lower() == ".html":
        from tolstat.render.page import page

        replace(path, page(view_document(view, title, sentence)).encode())
    else:
        from tolstat.render.figures import draw
        from tolstat.render.picture import write

        write(draw(view, title), path)
