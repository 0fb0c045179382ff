"""A mechanism as a picture that moves: lines on a sheet, bars below, frame by frame."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.arrays import Array
from tolstat.document.view_content import view_scale
from tolstat.model.mechanism import Line, Mechanism
from tolstat.model.view import Curve

WIDE = 9000  # of a sheet; all lengths on it are whole numbers
MARGIN, HIGHEST, LOWEST = 300, 6000, 900
ROW = 280  # of a bar
FRAME = 0.05  # s, for which a frame is seen
SEEN = 0.04  # of the sheet: as far as the largest deviation is drawn off
NICE = (5, 2, 1)
Places = NDArray[np.int64]


class Bar(NamedTuple):
    """A force over the frames: lengths from -1000 to 1000, and its words."""

    name: str
    colour: str
    lengths: Places  # [frame]
    nominal: Places | None
    words: tuple[str, ...]


class Scene(NamedTuple):
    """A sheet with lines, `WIDE` wide, and bars below it."""

    height: int  # of the lines, above the bars
    lines: tuple[Line, ...]
    ground: tuple[Places, ...]  # [corner, 2]
    points: Places  # [frame, point, 2], down and to the right
    nominal: Places | None  # None: the points are those of the nominal trial
    bars: tuple[Bar, ...]
    labels: tuple[str, ...]  # of the frames
    words: str  # how deviations are drawn
    start: int  # the frame that is seen at first, and on paper


def scene_of(unit: Mechanism, nominal: Mechanism | None) -> Scene:
    """Return the scene of a unit before the nominal one; None: it is the nominal one.

    Frames in which one of them has no answer are left out; none may be left.
    """
    both = [unit, nominal] if nominal else [unit]
    chosen = np.all([np.isfinite(m.points).all(axis=(1, 2)) for m in both], axis=0)
    ideal = both[-1].points if both[-1].reference is None else both[-1].reference
    rest, moved = ideal[chosen], [m.points[chosen] for m in both]
    if not len(rest):
        return Scene(0, (), (), np.zeros((0, 0, 2), int), None, (), (), "", 0)
    corners = [rest.reshape(-1, 2), *unit.ground]
    lower = np.min([c.min(axis=0) for c in corners], axis=0)
    upper = np.max([c.max(axis=0) for c in corners], axis=0)
    size = float(np.hypot(*(upper - lower))) or 1.0
    farthest = max(float(np.abs(points - rest).max()) for points in moved)
    times = _nice(SEEN * size / farthest) if farthest > 1e-12 * size else 1
    drawn = [rest + times * (points - rest) for points in moved]
    corners += [points.reshape(-1, 2) for points in drawn]
    lower = np.min([c.min(axis=0) for c in corners], axis=0)
    upper = np.max([c.max(axis=0) for c in corners], axis=0)
    wide, high = np.maximum(upper - lower, 1e-12 * size)
    scale = min((WIDE - 2 * MARGIN) / wide, HIGHEST / high)
    height = max(round(scale * high), LOWEST) + 2 * MARGIN
    middle = (lower + upper) / 2

    def on_sheet(points: Array) -> Places:
        centred = scale * (points - middle) * [1.0, -1.0] + [WIDE / 2, height / 2]
        return np.asarray(np.rint(centred), np.int64)

    apart = np.abs(drawn[0] - (drawn[-1] if nominal else rest)).max(axis=(1, 2))
    bars = tuple(_bars(unit, nominal, chosen))
    loaded = np.sum([np.abs(bar.lengths) for bar in bars], axis=0) if bars else 1
    return Scene(
        height,
        unit.lines,
        tuple(map(on_sheet, unit.ground)),
        on_sheet(drawn[0]),
        on_sheet(drawn[1]) if nominal else None,
        bars,
        _labels(unit, chosen),
        _words(unit, nominal, times),
        int((apart * loaded).argmax()),
    )


def _nice(times: float) -> int:
    """Return 1, 2, 5, 10, ...: the largest that is not above a number, or 1."""
    power = 10 ** max(int(np.floor(np.log10(max(times, 1.0)))), 0)
    return next((n * power for n in NICE if n * power <= times), 1)


def _words(unit: Mechanism, nominal: Mechanism | None, times: int) -> str:
    """Say what the colours are, how deviations are drawn, and how slowly it moves."""
    words = ["Grey: the nominal machine." if nominal else "The nominal machine."]
    if times > 1:
        what = "Deviations" if unit.reference is None else "Deviations and deflections"
        words.append(f"{what} are drawn {times} times too large.")
    if unit.axis.unit == "s" and np.ptp(unit.at) > 0:
        slower = FRAME * (len(unit.at) - 1) / float(np.ptp(unit.at))
        words.append(f"Time runs {slower:.2g} times slower.")
    return " ".join(words)


def _labels(unit: Mechanism, chosen: Array) -> tuple[str, ...]:
    """Return where each frame is on the axis."""
    if len(unit.at) == 1:
        return ("",)
    scale = view_scale(unit.axis.unit, unit.axis.shown, unit.at)
    name = unit.axis.name.replace("_", " ")
    return tuple(f"{name} {scale.words(float(x))}" for x in unit.at[chosen])


def _bars(unit: Mechanism, nominal: Mechanism | None, chosen: Array) -> Sequence[Bar]:
    """Return the bars; those of one unit have one scale."""
    other = {bar.name: bar for bar in nominal.bars} if nominal else {}

    def values(bar: Curve) -> list[Array]:
        curves = [bar, other[bar.name]] if bar.name in other else [bar]
        return [np.nan_to_num(curve.values[chosen]) for curve in curves]

    largest: dict[str, float] = {}
    for bar in unit.bars:
        top = max(float(np.abs(part).max()) for part in values(bar))
        largest[bar.unit] = max(largest.get(bar.unit, 0.0), top)
    bars = []
    for bar in unit.bars:
        size = largest[bar.unit] or 1.0
        scale = view_scale(bar.unit, bar.shown, np.array([size]))
        lengths = [np.rint(1000 * x / size).astype(np.int64) for x in values(bar)]
        grey = lengths[1] if len(lengths) > 1 else None
        words = tuple(scale.words(float(x)) for x in values(bar)[0])
        name = ", ".join(filter(None, [bar.sentence, bar.symbol])) or bar.name
        bars.append(Bar(name, bar.colour, lengths[0], grey, words))
    return bars
