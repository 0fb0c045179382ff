"""The style of pictures, and a picture as a file or as a part of a page."""

import tolstat.render.any_backend  # noqa: F401

# isort: split
import io
import re
from itertools import count
from typing import Any

import matplotlib as mpl
from cycler import cycler
from markupsafe import Markup, escape
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.ticker import LogFormatter

from tolstat.literal import visible

# distinct in print and for the colour-blind (Okabe and Ito, 2008)
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
    "axes.formatter.useoffset": False,  # 20.004, not 0.004 below +2e1
    "text.parse_math": False,  # titles and names are from users
    "legend.fontsize": 9,
    "svg.hashsalt": "tolstat",  # the same picture is the same file
}
# placeholders that the page's style replaces, in light and in dark
INK, GRID = "#101418", "#e1e3e6"
SMALLEST = 8.4  # points, so that on paper no word of a picture has less than 8
PAGE_STYLE = {
    **STYLE,
    **dict.fromkeys(
        ("text.color", "axes.labelcolor", "axes.edgecolor", "xtick.color",
         "ytick.color"), INK,
    ),
    "grid.color": GRID,
    **dict.fromkeys(
        ("figure.facecolor", "axes.facecolor", "savefig.facecolor"), "none"
    ),
    **dict.fromkeys(
        ("font.size", "axes.titlesize", "axes.labelsize", "xtick.labelsize",
         "ytick.labelsize", "legend.fontsize"), SMALLEST,
    ),
    # where a grid shows the place, ticks tell nothing and take their time
    **dict.fromkeys(("xtick.bottom", "ytick.left"), False),
    **dict.fromkeys(("xtick.major.size", "ytick.major.size"), 0.0),
    **dict.fromkeys(("xtick.major.pad", "ytick.major.pad"), 5.0),
    # words stay words: a page is a quarter smaller, and they are found by a search
    "svg.fonttype": "none",
    "font.sans-serif": ["DejaVu Sans", "Verdana", "sans-serif"],  # of one width
}  # fmt: skip
_numbers = count(1)


def logarithmic(axis: Axis, **options: Any) -> None:
    """Make an axis logarithmic, with plain numbers: pictures have no markup.

    With `linthresh` it is linear up to that, through zero.
    """
    axes = axis.axes
    scale = axes.set_xscale if axis is axes.xaxis else axes.set_yscale
    scale("symlog" if options else "log", **options)
    axis.set_major_formatter(_Plain(**options))
    if not options:
        axis.set_minor_formatter(_Plain())


class _Plain(LogFormatter):
    """Numbers along a logarithmic axis, where they have room."""

    def __call__(self, x: float, pos: int | None = None) -> str:
        return f"{x:g}" if super().__call__(x, pos) else ""


def picture(figure: Figure, ending: str) -> bytes:
    """Return a picture as a file of that ending."""
    with mpl.rc_context(STYLE):
        return _saved(figure, ending.removeprefix("."), dpi=150)


def inline(figure: Figure, alternative: str) -> Markup:
    """Return a figure as SVG for a page: one element with unique names.

    It has the style of the page. `alternative` describes the figure for screen
    readers.
    """
    text = _saved(figure, "svg", dpi=110).decode()
    svg = text[text.index("<svg") :]
    svg = re.sub(r"<metadata>.*?</metadata>", "", svg, flags=re.DOTALL)
    # its style would apply to the whole page; page.css has the same rules
    svg = re.sub(r"<defs>\s*<style.*?</style>\s*</defs>", "", svg, flags=re.DOTALL)
    svg = svg.replace(INK, "currentColor").replace(GRID, "var(--grid)")
    svg = svg.replace(LIMIT, "var(--not-met)")
    prefix = f"p{next(_numbers)}-"
    svg = re.sub(r'(\bid="|href="#|url\(#)', rf"\1{prefix}", svg)
    # lines to a hundredth of a point
    svg = re.sub(
        r'\bd="[^"]*"', lambda d: re.sub(r"(\.\d{2})\d+", r"\1", d.group()), svg
    )
    head = f'<svg role="img" aria-label="{escape(visible(alternative))}"'
    svg = svg.replace("<svg", head, 1)
    svg = re.sub(r'\b(width|height)="[\d.]+pt"\s*', "", svg, count=2)
    return Markup(svg)


def _saved(figure: Figure, form: str, dpi: int) -> bytes:
    """Return a figure in a file format, with its texts shown literally."""
    for text in figure.findobj(Text):
        assert isinstance(text, Text)
        if (words := visible(text.get_text())) != text.get_text():
            text.set_text(words)
    if engine := figure.get_layout_engine():
        # once, and no engine left: with one, matplotlib draws everything twice
        engine.execute(figure)
        figure.set_layout_engine(None)
    buffer = io.BytesIO()
    # no date: the same picture is the same file
    metadata = {"Date": None} if form == "svg" else None
    figure.savefig(buffer, format=form, dpi=dpi, metadata=metadata)
    return buffer.getvalue()
