"""Pages made: the report of a run, the comparison of two, a view."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from tolstat.errors import PictureError
from tolstat.model.view import Listing, View
from tolstat.render.output_file import check_output, replace
from tolstat.store.open_run import open as open_run
from tolstat.store.stored_run import Run

PICTURES = (".png", ".svg", ".pdf")


def compare(
    first: Run | str | os.PathLike[str],
    second: Run | str | os.PathLike[str],
    output: str | os.PathLike[str],
    responses: Sequence[str] = (),
    others: Sequence[Run | str | os.PathLike[str]] = (),
) -> Path:
    """Compare runs with the first of them, on a page.

    Machine by machine where both runs have the same, or of the same qualities; see
    `tolstat.answers.compare.pairing.pair_of`.

    Parameters
    ----------
    first, second : Run or path
        The runs.
    output : path
        The page.
    responses : sequence of str
        What is looked at closely; what has a limit if none are given.
    others : sequence of Run or path
        More runs.

    Raises
    ------
    PictureError
        If machines were not drawn, or no response is in both.
    RunFileError
        If a run cannot be read, or the page not be written.
    """
    from tolstat.answers.compare.comparison import compared_with_first
    from tolstat.answers.compare.comparison_page import make_comparison_page

    check_output(Path(output))
    every = [
        run if isinstance(run, Run) else open_run(run)
        for run in (first, second, *others)
    ]
    pairs, found = compared_with_first(every, responses)
    return write(Path(output), make_comparison_page(pairs, found))


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
    from tolstat.answers.report.template_page import environment, style
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
