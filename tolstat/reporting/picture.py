"""How pictures of tolstat look, and how they are written."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib as mpl
from cycler import cycler
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from tolstat.errors import PictureError

ENDINGS = (".png", ".svg", ".pdf")
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


def check_ending(path: Path) -> None:
    """Refuse a file that is no picture, before anything is simulated.

    Raises
    ------
    PictureError
        If the file ends otherwise.
    """
    if path.suffix.lower() not in ENDINGS:
        raise PictureError(
            f"{path}: a picture ends in {', '.join(ENDINGS[:-1])} or {ENDINGS[-1]}"
        )


def write(figure: Figure, path: Path) -> None:
    """Write a picture.

    Parameters
    ----------
    figure : Figure
        Drawn.
    path : Path
        Its ending decides the format.

    Raises
    ------
    PictureError
        If it cannot be written.
    """
    svg = path.suffix.lower() == ".svg"
    try:
        with styled():
            # no date: the same picture is the same file
            figure.savefig(path, dpi=150, metadata={"Date": None} if svg else None)
    except OSError as error:
        raise PictureError(f"{path} cannot be written: {error}") from error


def mark_level(axes: Axes, value: float, words: str) -> Line2D:
    """Mark a value (in the unit shown) across all of a picture, for the legend."""
    return axes.axhline(
        value, color=LIMIT, linestyle="--", linewidth=1, label=words or "_unnamed"
    )
