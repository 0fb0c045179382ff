"""The style of pictures, and a picture as a file."""

import tolstat.render.any_backend  # noqa: F401

# isort: split
import io
from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure
from matplotlib.text import Text

from tolstat.literal import visible

STYLE: dict[Any, Any] = {
    "font.size": 10,
    "axes.titlesize": 10,
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#e4e4e4",
    "grid.linewidth": 0.6,
    "lines.linewidth": 1.2,
    "legend.frameon": False,
    "text.parse_math": False,  # titles and names are from users
    "legend.fontsize": 9,
    "svg.hashsalt": "tolstat",  # the same picture is the same file
}


def picture(figure: Figure, ending: str) -> bytes:
    """Return a picture as a file of that ending, with its texts shown literally."""
    for text in figure.findobj(Text):
        assert isinstance(text, Text)
        if (words := visible(text.get_text())) != text.get_text():
            text.set_text(words)
    buffer, form = io.BytesIO(), ending.removeprefix(".")
    # no date: the same picture is the same file
    metadata = {"Date": None} if form == "svg" else None
    with mpl.rc_context(STYLE):
        figure.savefig(buffer, format=form, dpi=150, metadata=metadata)
    return buffer.getvalue()
