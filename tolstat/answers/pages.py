"""Pages made: the report of a run, the comparison of two, a view."""

from __future__ import annotations

from pathlib import Path

from tolstat.errors import PictureError
from tolstat.model.view import Listing, View
from tolstat.render.output_file import check_output, replace

PICTURES = (".png", ".svg", ".pdf")


def save_view(view: View, path: Path, title: str, sentence: str = "") -> None:
    """Write a view: as a picture, a table of numbers, or a page, by the file's ending.

    Parameters
    ----------
    view : Chart or Listing
        As a machine shows it.
    path : Path
        Ends in .png, .svg, .pdf, .csv or .html.
    title, sentence : str
        Which machine, and what is shown.

    Raises
    ------
    PictureError
        If the ending is another, or it cannot be written.
    """
    check_view_ending(path)
    if path.suffix.lower() == ".csv":
        from tolstat.render.view_table import as_csv

        write(path, as_csv(view))
    elif path.suffix.lower() == ".html":
        write(path, view_page(view, title, sentence))
    else:
        from tolstat.render import picture
        from tolstat.render.view_picture import draw_view

        picture.write(draw_view(view, title), path)


def view_page(view: View, title: str, sentence: str = "") -> str:
    """Make a page of a view: a chart as a picture, a listing as a table."""
    from tolstat.render.page import environment, style
    from tolstat.render.page_picture import inline
    from tolstat.render.view_picture import draw_view
    from tolstat.render.view_table import view_rows

    picture, heads, rows = None, list[str](), list[list[str]]()
    if isinstance(view, Listing):
        heads, rows = view_rows(view)
    else:
        picture = inline(draw_view(view, ""), sentence or title)
    template = environment().get_template("view.html")
    page: str = template.render(
        title=title, sentence=sentence, style=style(), picture=picture, heads=heads,
        rows=rows,
    )  # fmt: skip
    return page


def check_view_ending(path: Path) -> None:
    """Refuse a file that a view cannot be written to, before anything is simulated."""
    endings = (*PICTURES, ".csv", ".html")
    if path.suffix.lower() not in endings:
        raise PictureError(
            f"{path}: a view ends in {', '.join(endings[:-1])} or {endings[-1]}"
        )
    check_output(path)


def write(path: Path, text: str) -> Path:
    """Write a text file.

    Raises
    ------
    RunFileError
        If it cannot be written.
    """
    return replace(path, text.encode())
