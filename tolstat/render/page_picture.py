"""How pictures get into a page: drawn for it, and inlined as SVG."""

from __future__ import annotations

import io
import re
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import count
from typing import Any

import matplotlib as mpl
from markupsafe import Markup, escape
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import AutoLocator, FixedLocator, MaxNLocator

from tolstat.literal import visible
from tolstat.render.picture import literally, styled

# stand-ins that the page's style replaces: the same picture in light and in dark
INK, GRID = "#101418", "#e1e3e6"
MOST_POINTS = 2000  # of a scatter, above which it is rasterised
WIDTH, HEIGHT = 3.5, 2.5  # inches: half a printed page, and a phone
SMALLEST = 8.4  # points, so that on paper no word of a picture has less than 8
PAGE_STYLE: dict[Any, Any] = {
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
    "svg.fonttype": "path",
}  # fmt: skip
_numbers = count(1)


@contextmanager
def page_figure(width: float = WIDTH, height: float = HEIGHT) -> Iterator[Figure]:
    """Open a figure in the style of the page; width and height in inches."""
    with styled(), mpl.rc_context(PAGE_STYLE):
        yield Figure(figsize=(width, height), layout="constrained")


def few_ticks(axes: Axes) -> None:
    """Leave four or five ticks, all in the picture: each costs, one beyond it too."""
    for axis in (axes.xaxis, axes.yaxis):
        if isinstance(axis.get_major_locator(), FixedLocator):
            continue
        if isinstance(axis.get_major_locator(), AutoLocator):
            axis.set_major_locator(MaxNLocator(5))
        low, high = axis.get_view_interval()
        axis.set_ticks([at for at in axis.get_majorticklocs() if low <= at <= high])


def legend_above(axes: Axes) -> None:
    """Put the legend over the picture, where it hides nothing."""
    handles, labels = axes.get_legend_handles_labels()
    figure = axes.get_figure(root=True)
    assert figure is not None
    renderer = FigureCanvasAgg(figure).get_renderer()  # type: ignore[no-untyped-call]
    for columns in (3, 2, 1) if handles else ():
        legend = figure.legend(
            handles, labels, loc="outside upper left", ncols=columns,
            borderaxespad=0.0, handlelength=1.4, columnspacing=1.1,
        )  # fmt: skip
        if legend.get_window_extent(renderer).width <= figure.bbox.width:
            return
        if columns > 1:
            legend.remove()


def inline(figure: Figure, alternative: str) -> Markup:
    """Write a figure as SVG for a page: one element, whose names are its own there.

    The figure is that of `page_figure`, while its style holds; `alternative` says what
    it shows, for those who do not see it.
    """
    literally(figure)
    buffer = io.StringIO()
    if engine := figure.get_layout_engine():
        # once, and no engine left: with one, matplotlib draws everything twice
        engine.execute(figure)
        figure.set_layout_engine(None)
    figure.savefig(buffer, format="svg", dpi=110, metadata={"Date": None})
    text = buffer.getvalue()
    svg = text[text.index("<svg") :]
    svg = re.sub(r"<metadata>.*?</metadata>", "", svg, flags=re.DOTALL)
    # its style would hold for the whole page; page.css says the same of pictures
    svg = re.sub(r"<defs>\s*<style.*?</style>\s*</defs>", "", svg, flags=re.DOTALL)
    svg = svg.replace(INK, "currentColor").replace(GRID, "var(--grid)")
    prefix = f"p{next(_numbers)}-"
    svg = re.sub(r'\bid="', f'id="{prefix}', svg)
    svg = re.sub(r'(xlink:href|href)="#', rf'\1="#{prefix}', svg)
    svg = re.sub(r"url\(#", f"url(#{prefix}", svg)
    # lines to a hundredth of a point
    svg = re.sub(
        r'\bd="[^"]*"', lambda d: re.sub(r"(\.\d{2})\d+", r"\1", d.group()), svg
    )
    head = f'<svg role="img" aria-label="{escape(visible(alternative))}"'
    svg = svg.replace("<svg", head, 1)
    svg = re.sub(r'\b(width|height)="[\d.]+pt"\s*', "", svg, count=2)
    return Markup(svg)
