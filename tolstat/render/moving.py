"""A scene as SVG with its frames and the script that shows them."""

import json
from collections.abc import Iterator
from functools import cache
from importlib.resources import files
from typing import Any, NamedTuple

from markupsafe import Markup

from tolstat.document.scene import FRAME, ROW, WIDE, Bar, Places, Scene
from tolstat.literal import visible
from tolstat.render.colours import INK, ROLES

GREY = "#8a929c"
TEXT = 170  # size of letters
MIDDLE, HALF, NUMBERS = 6000, 1600, 7750  # of bars: zero, the longest, their words


class Moving(NamedTuple):
    """A scene for a page."""

    caption: Markup
    picture: Markup  # of one frame
    controls: Markup  # with all frames and the script; empty where there is one frame


def as_moving(scene: Scene, alt: str) -> Moving:
    """Return a scene for a page: one frame, and what shows the others."""
    high = scene.height + ROW * len(scene.bars) + ROW // 2
    svg = Markup(
        '<svg role="img" aria-label="{}" viewBox="0 0 {} {}" font-size="{}" '
        'fill="currentColor">{}</svg>'
    ).format(visible(alt), WIDE, high, TEXT, Markup("\n").join(_content(scene)))
    caption = Markup('{} <output class="label">{}</output>').format(
        scene.words, scene.labels[scene.start]
    )
    data = {
        "points": [frame.ravel().tolist() for frame in scene.points],
        "nominal": [] if scene.nominal is None
        else [frame.ravel().tolist() for frame in scene.nominal],
        "labels": scene.labels,
        "bars": [_bar_data(bar) for bar in scene.bars],
        "middle": MIDDLE, "half": HALF, "start": scene.start, "frame": 1000 * FRAME,
    }  # fmt: skip
    if len(scene.points) < 2:
        return Moving(caption, svg, Markup(""))
    content = json.dumps(data, separators=(",", ":")).replace("<", "\\u003c")
    controls = Markup(
        '<p class="controls" hidden><button type="button">Play</button> '
        '<input type="range" min="0" max="{}" value="{}" aria-label="frame"></p>'
        '<script type="application/json">{}</script><script>{}</script>'
    ).format(len(scene.points) - 1, scene.start, Markup(content), _script())
    return Moving(caption, svg, controls)


@cache
def _script() -> Markup:
    text = files("tolstat.render").joinpath("templates/moving.js").read_text("utf-8")
    return Markup(text)


def _content(scene: Scene) -> Iterator[Markup]:
    """Yield the elements of the frame that is seen at first."""
    for corners in scene.ground:
        yield _line(_points(corners), INK, 12, "")
    kinds = (("nominal", scene.nominal), ("points", scene.points))
    for kind, frames in kinds:
        if frames is None:
            continue
        frame, grey = frames[scene.start], kind == "nominal"
        for line in scene.lines:
            joined = frame[[*line.points]]
            name = Markup(' data-of="{}" data-points="{}"').format(
                kind, " ".join(map(str, line.points))
            )
            colour = GREY if grey else ROLES[line.colour]
            title = line.name + ", nominal" * grey
            yield _line(_points(joined), colour, 36 if grey else 30, title, name)
            for place, (x, y) in zip(line.points, joined, strict=True):
                if line.joints and not grey:
                    yield Markup(
                        '<circle cx="{}" cy="{}" r="45" fill="{}" data-point="{}"/>'
                    ).format(x, y, colour, place)
    for i, bar in enumerate(scene.bars):
        yield from _bar(bar, scene.height + ROW * i + ROW // 2, scene.start)


def _bar(bar: Bar, y: int, frame: int) -> Iterator[Markup]:
    """Yield a bar: name, lengths from the middle, number."""
    yield Markup('<text x="0" y="{}">{}</text>').format(
        y + TEXT // 3, visible(bar.name)
    )
    for values, colour, thick, kind in (
        (bar.nominal, GREY, 150, "nominal"),
        (bar.lengths, ROLES[bar.colour], 80, "points"),
    ):
        if values is not None:
            end = MIDDLE + HALF * int(values[frame]) // 1000
            yield Markup(
                '<line x1="{}" y1="{}" x2="{}" y2="{}" stroke="{}" stroke-width="{}" '
                'class="bar" data-of="{}"/>'
            ).format(MIDDLE, y, end, y, colour, thick, kind)
    yield Markup(
        '<line x1="{0}" y1="{1}" x2="{0}" y2="{2}" stroke="currentColor" '
        'stroke-width="8"/>'
    ).format(MIDDLE, y - ROW // 2, y + ROW // 2)
    yield Markup('<text x="{}" y="{}" class="number">{}</text>').format(
        NUMBERS, y + TEXT // 3, bar.words[frame]
    )


def _bar_data(bar: Bar) -> dict[str, Any]:
    return {
        "points": bar.lengths.tolist(),
        "nominal": None if bar.nominal is None else bar.nominal.tolist(),
        "words": bar.words,
    }


def _line(points: str, colour: str, thick: int, title: str, more: str = "") -> Markup:
    name = Markup("<title>{}</title>").format(visible(title)) if title else ""
    return Markup(
        '<polyline points="{}" fill="none" stroke="{}" stroke-width="{}"{}>{}'
        "</polyline>"
    ).format(points, "currentColor" if colour == INK else colour, thick, more, name)


def _points(places: Places) -> str:
    return " ".join(f"{x},{y}" for x, y in places.tolist())
