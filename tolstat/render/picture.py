"""How pictures of tolstat look, and how they are written."""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib as mpl
from cycler import cycler
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.ticker import LogFormatter

from tolstat.errors import PictureError, RunFileError
from tolstat.literal import visible
from tolstat.render.output_file import replace

PICTURES = (".png", ".svg", ".pdf")
# told apart in print and by the colour-blind (Okabe and Ito, 2008)
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00")
LIMIT = "#b00020"
STYLE: dict[Any, Any] = {
    "font.size": 10,
    "axes.titlesize": 10,
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.prop_cycle": cycler(color=COLOURS),
    "axes.grid": True,
    "grid.color": "#e4e4e4",
    "grid.linewidth": 0.6,
    "lines.linewidth": 1.2,
    "legend.frameon": False,
    "text.parse_math": False,  # titles and names are anybody's
    "legend.fontsize": 9,
    "svg.hashsalt": "tolstat",  # the same picture is the same file
}


@contextmanager
def styled() -> Iterator[None]:
    """Use the style of tolstat's pictures, for these lines alone."""
    with mpl.rc_context(STYLE):
        yield


def logarithmic(axis: Axis, **options: Any) -> None:
    """Make an axis logarithmic, with plain numbers: pictures read no markup.

    With `linthresh` it is linear up to that, through zero.
    """
    axes = axis.axes
    scale = axes.set_xscale if axis is axes.xaxis else axes.set_yscale
    scale("symlog" if options else "log", **options)
    axis.set_major_formatter(_Plain(**options))
    if not options:
        axis.set_minor_formatter(_Plain())


class _Plain(LogFormatter):
    """Numbers along a logarithmic axis, those of them that have room."""

    def __call__(self, x: float, pos: int | None = None) -> str:
        return f"{x:g}" if super().__call__(x, pos) else ""


def literally(figure: Figure) -> None:
    """Let every text of a picture be what it is, before it is written."""
    for text in figure.findobj(Text):
        assert isinstance(text, Text)
        if (words := visible(text.get_text())) != text.get_text():
            text.set_text(words)


def write(figure: Figure, path: Path) -> None:
    """Write a picture in the format of the file's ending.

    Raises
    ------
    PictureError
        If it cannot be written.
    """
    form = path.suffix.lower().removeprefix(".")
    drawn = io.BytesIO()
    with styled():
        literally(figure)
        # no date: the same picture is the same file
        metadata = {"Date": None} if form == "svg" else None
        figure.savefig(drawn, format=form, dpi=150, metadata=metadata)
    try:
        replace(path, drawn.getvalue())
    except RunFileError as error:
        raise PictureError(str(error)) from error


def in_legend(words: str) -> str:
    """Return a label that a legend shows: it hides those that begin with _."""
    return visible(f" {words}" if words.startswith("_") else words)
