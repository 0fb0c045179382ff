"""A plot as SVG for a page."""

from collections.abc import Iterator, Sequence
from itertools import count

import numpy as np
from markupsafe import Markup, escape

from tolstat.arrays import Array
from tolstat.document.plot import Plot
from tolstat.literal import visible
from tolstat.render.colours import ON_PAGE
from tolstat.render.panels import (
    EDGE,
    GAP,
    LINE,
    SAMPLE,
    SIZE,
    Picture,
    entry_width,
    laid_out,
    wrapped,
)
from tolstat.render.shapes import Shape

STYLE = f"font:{SIZE}px DejaVu Sans,Verdana,sans-serif;fill:currentColor"
DASHES = {"--": "4.4 1.9", ":": "1.2 2", "-.": "7.7 1.9 1.2 1.9"}
CELLS = 2  # of a point: where dots lie that may be seen through
# dots of a size of one, around a place
DOTS = {
    "o": "h0",
    "|": "m0-.5v1",
    "rings": "m-.5 0a.5.5 0 1 0 1 0a.5.5 0 1 0-1 0",
    ">": "m-.5-.5l1 .5l-1 .5z",
    "<": "m.5-.5l-1 .5l1 .5z",
}
_numbers = count(1)


def as_svg(plot: Plot, alt: str) -> Markup:
    """Return a figure as SVG for a page, with unique names; `alt` describes it."""
    high, pictures = laid_out(plot)
    head = (
        f'<svg role="img" aria-label="{escape(visible(alt))}" '
        f'viewBox="0 0 {72 * plot.width:g} {72 * high:g}" style="{STYLE}">'
    )
    elements = [e for picture in pictures for e in _elements(picture)]
    return Markup("\n".join([head, *elements, "</svg>"]))


def _elements(picture: Picture) -> Iterator[str]:
    """Yield the elements of a panel, from back to front."""
    left, top, right, bottom = picture.box
    name = f"p{next(_numbers)}-"  # of no response
    across = [(left + (right - left) * t.part, t.words) for t in picture.x_ticks]
    up = [
        (bottom - (bottom - top) * t.part, t.words) for t in picture.y_ticks(picture.y)
    ]
    lines = [f"M{x:.1f} {top:.1f}V{bottom:.1f}" for x, _ in across]
    lines += [f"M{left:.1f} {y:.1f}H{right:.1f}" for y, _ in up if not picture.bars]
    yield _line("".join(lines), "grid", 0.6)
    yield (
        f'<clipPath id="{name}"><rect x="{left:.1f}" y="{top:.1f}" '
        f'width="{right - left:.1f}" height="{bottom - top:.1f}"/></clipPath>'
    )
    clipped, others = [""], [""]
    for shapes, ruler in ((picture.shapes, picture.y), (picture.others, picture.y2)):
        for shape in shapes:
            x = left + (right - left) * picture.x.part(shape.x)
            y = bottom - (bottom - top) * ruler.part(shape.y)
            (clipped if shape.clip else others).extend(_drawn(shape, x, y))
    yield f'<g clip-path="url(#{name})">{"".join(clipped)}</g>{"".join(others)}'
    frame = f"M{left:.1f} {top:.1f}V{bottom:.1f}H{right:.1f}"
    yield _line(frame + f"V{top:.1f}" * bool(picture.panel.right), "ink", 0.8)
    yield from _words(picture, across, up)
    yield from _above(picture)


def _words(
    picture: Picture,
    across: Sequence[tuple[float, str]],
    up: Sequence[tuple[float, str]],
) -> Iterator[str]:
    """Yield the words along the axes, and on the right of bars."""
    panel, (left, top, right, bottom) = picture.panel, picture.box
    middle, lower = (top + bottom) / 2, bottom + picture.below
    if picture.under:
        for x, words in across:
            if panel.x.words:
                yield _text(x, bottom + GAP, wrapped(words).split("\n"), "end", -90)
            else:
                yield _text(x, lower - 2, [words], "middle")
        x, words = picture.lower_label
        yield _text(x, lower + LINE - 2, [words], "middle")
    if picture.first:
        for y, words in up:
            yield _text(left - GAP, y + SIZE / 3, [words], "end")
        x, label = left - picture.beside + LINE, picture.label(panel.y.label)
        yield _text(x, middle, label, "middle", -90)
    for (y, _), words in zip(
        up, picture.bars.words if picture.bars else (), strict=False
    ):
        yield _text(right + GAP, y + SIZE / 3, [words])
    if panel.right:
        for tick in picture.y_ticks(picture.y2):
            y = bottom - (bottom - top) * tick.part
            yield _text(right + GAP, y + SIZE / 3, [tick.words])
        x, label = right + picture.room - GAP, picture.label(panel.right.y.label)
        yield _text(x, middle, label, "middle", -90)


def _above(picture: Picture) -> Iterator[str]:
    """Yield title, legend and the words of marks."""
    left, top, right, _ = picture.box
    y = top - GAP
    for mark, part, line in picture.marks:
        x = left + (right - left) * part
        yield _text(x, y - LINE * line, [mark.words], "middle")
    if picture.panel.title:
        yield _text(left, y, [picture.panel.title])
        y -= LINE * (not picture.title_beside)
    for row in reversed(picture.rows):
        x = max(right - sum(map(entry_width, row)) + 2 * GAP, EDGE)
        for entry in row:
            along, at = x + np.array([0, SAMPLE]), np.full(2, y - SIZE / 3)
            if entry.area:
                along, at = along[[0, 1, 1, 0]], at[0] + np.array([-3, -3, 3, 3])
            dot = entry._replace(area=False, dash="")
            yield from _drawn(entry._replace(dot=""), along, at)
            yield from _drawn(dot, along[:1] + SAMPLE / 2, at[:1])
            yield _text(x + SAMPLE + GAP, y, [entry.name])
            x += entry_width(entry)
        y -= LINE


def _drawn(shape: Shape, x: Array, y: Array) -> Iterator[str]:
    """Yield the elements of a shape."""
    x, y = np.broadcast_arrays(x, y)
    colour, alpha = shape.colour, shape.alpha
    if shape.area:
        opacity = f' fill-opacity="{alpha}"' if alpha < 1 else ""
        yield f'<path d="{_path(x, y, "Z")}" style="fill:{ON_PAGE[colour]}"{opacity}/>'
    elif shape.dash:
        yield _line(_path(x, y), colour, shape.width, DASHES.get(shape.dash, ""), alpha)
    if not shape.dot:
        return
    seen, fill = np.isfinite(x) & np.isfinite(y), "none"
    places, unit = np.stack([x[seen], y[seen]], axis=1), shape.size
    times, letter = np.ones(len(places), int), "M"
    look = f'stroke-width="{1 / unit:.2f}"'
    if shape.dot in "<>":
        fill = ON_PAGE[colour]
    if alpha < 1:  # dots on each other hide more of what is behind
        unit, letter = 1 / CELLS, "m"  # small whole numbers, from dot to dot
        cells, times = np.unique(np.rint(CELLS * places), axis=0, return_counts=True)
        places = cells / CELLS
    if shape.dot == "o":
        look = f'stroke-width="{shape.size / unit:g}" stroke-linecap="round"'
    for number in np.unique(times).tolist():
        chosen = places[times == number] / unit
        chosen = np.diff(chosen, axis=0, prepend=0.0) if alpha < 1 else chosen.round(2)
        dots = (f"{letter}{a:g} {b:g}{DOTS[shape.dot]}" for a, b in chosen.tolist())
        opacity = f' stroke-opacity="{1 - (1 - alpha) ** number:.2f}"' * (alpha < 1)
        yield (
            f'<path transform="scale({unit})" d="{"".join(dots)}" '
            f'style="fill:{fill};stroke:{ON_PAGE[colour]}" {look}{opacity}/>'
        )


def _path(x: Array, y: Array, close: str = "") -> str:
    """Return the path through points; NaN leaves a gap."""
    path, pen = list[str](), "M"
    for a, b in zip(x.tolist(), y.tolist(), strict=True):
        is_point = a == a and b == b
        path.append(f"{pen}{a:.2f} {b:.2f}" if is_point else close)
        pen = "L" if is_point else "M"
    return "".join(path) + close * (pen == "L")


def _line(
    path: str, colour: str, width: float, dash: str = "", alpha: float = 1.0
) -> str:
    more = f' stroke-dasharray="{dash}"' if dash else ""
    more += f' stroke-opacity="{alpha}"' if alpha < 1 else ""
    return (
        f'<path d="{path}" fill="none" style="stroke:{ON_PAGE[colour]}" '
        f'stroke-width="{width}"{more}/>'
    )


def _text(
    x: float, y: float, lines: Sequence[str], anchor: str = "start", turn: int = 0
) -> str:
    """Return words in lines; those of turned ones follow to the right."""
    turned = f' transform="rotate({turn} {x:.1f} {y:.1f})"' if turn else ""
    words = "".join(
        f'<tspan x="{x:.1f}" y="{y + LINE * i:.1f}">{escape(visible(line))}</tspan>'
        if i else str(escape(visible(line))) for i, line in enumerate(lines)
    )  # fmt: skip
    place = f'x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}"'
    return f"<text {place}{turned}>{words}</text>" if words else ""
