"""Where the panels of a plot and their words lie, for a page."""

from collections.abc import Sequence
from textwrap import wrap
from typing import NamedTuple

import numpy as np

from tolstat.arrays import Integers
from tolstat.document.plot import Bars, Mark, Plot, PlotPanel
from tolstat.literal import visible
from tolstat.render.shapes import Shape, shapes_of
from tolstat.render.ticks import Ruler, Tick, shared

SIZE = 8.4  # points, so that on paper no word of a picture has less than 8
LINE, EDGE, GAP = 10.5, 3.0, 4.0  # points: of words; around all; between two things
SAMPLE = 12.0  # points of a line or an area in a legend
SLOTS = 3  # panels side by side that a figure has room for, however few there are
BESIDE = 10.0  # points between these
# points: of bars beside words, narrower ones stand alone; of a panel without height
LEAST = 36.0
APART = 30.0, 16.0  # points between numbers along an axis, at least
MOST_TICKS, BETWEEN_WORDS = 6, 3  # on an upright axis; beside words on both sides
NAME, LONGEST = 28, 18  # letters of a name below an axis in a line; beside bars
# widths of letters of DejaVu Sans, over its size
WIDTHS = {
    letter: width
    for width, letters in (
        (0.34, "'ijlIJ ,./:;\\|"), (0.42, 'f-()[]t!r"'), (0.53, "*_`sz?"),
        (0.64, "cLFkvxyPTYaoeESbdghnpqu$0123456789{}"), (0.7, "KAVBRXZC"),
        (0.8, "UHNDG&OQ"), (0.86, "w#+<=>^~M"), (1.0, "%mW@"),
    )
    for letter in letters
}  # fmt: skip


def laid_out(plot: Plot) -> tuple[float, list["Picture"]]:
    """Return the panels of a plot with their places, and its height, inches.

    It is higher than planned where words would leave panels no height.
    """
    pictures = [Picture(p, plot.legends or not i) for i, p in enumerate(plot.panels)]
    if plot.side_by_side:
        _side_by_side(plot, pictures)
    elif (high := _stacked(plot, pictures)) <= 0:
        missing = len(pictures) * (LEAST - high) / 72
        plot = plot._replace(height=plot.height + missing)
        _stacked(plot, pictures)
    return plot.height, pictures


def _stacked(plot: Plot, pictures: Sequence["Picture"]) -> float:
    """Lay out panels one below the other, over one axis; return their height."""
    last, n, wide = pictures[-1], len(pictures), 72 * plot.width
    for picture, ruler in zip(pictures, shared([p.x for p in pictures]), strict=True):
        picture.x, picture.under = ruler, picture is last
        picture.box = Box(0.0, 0.0, wide, 36 * plot.height / n)  # at first about
    left, right = (EDGE + max(ends) for ends in _ends(pictures))
    if last.bars and wide - left - right < LEAST:  # the page has these words
        last.bars = last.bars._replace(words=())
        left, right = (EDGE + max(ends) for ends in _ends(pictures))
    heads = [picture.head(wide - left - right, left - EDGE) for picture in pictures]
    below = EDGE + LINE * bool(last.panel.x.label) + last.below
    free = (72 * plot.height - below - sum(heads) - EDGE * (2 * n - 1)) / n
    for picture in pictures:
        picture.box = Box(0.0, 0.0, wide, free)
    left, right = (EDGE + max(ends) for ends in _ends(pictures))
    top = EDGE
    for picture, head in zip(pictures, heads, strict=True):
        top += head
        picture.box = Box(left, top, wide - right, top + free)
        picture.along = EDGE, wide - EDGE
        top += free + 2 * EDGE
    return free


def _ends(pictures: Sequence["Picture"]) -> tuple[list[float], list[float]]:
    return [picture.beside for picture in pictures], [p.room for p in pictures]


def _side_by_side(plot: Plot, pictures: Sequence["Picture"]) -> None:
    """Lay out panels beside each other, against one upright axis."""
    slots = max(len(pictures), SLOTS)
    for picture, ruler in zip(pictures, shared([p.y for p in pictures]), strict=True):
        picture.y, picture.first = ruler, picture is pictures[0]
    top = EDGE + max(picture.head(72 * plot.width / slots) for picture in pictures)
    bottom = 72 * plot.height - EDGE - LINE - max(p.below for p in pictures)
    for picture in pictures:
        picture.box = Box(0.0, top, 72 * plot.width / slots, bottom)
    left = EDGE + pictures[0].beside
    right = EDGE + max(picture.room for picture in pictures)
    wide = (72 * plot.width - left - right - BESIDE * (slots - 1)) / slots
    for i, picture in enumerate(pictures):
        start = left + i * (wide + BESIDE)
        picture.box = Box(start, top, start + wide, bottom)
        picture.along = start - BESIDE / 2 + 1, start + wide + BESIDE / 2 - 1


def width_of(words: str) -> float:
    """Return about how wide the longest of some lines is, in points."""
    lines = visible(words).split("\n")
    return SIZE * max(sum(WIDTHS.get(c, 0.64) for c in line) for line in lines)


class Box(NamedTuple):
    """Where axes are, points from the upper left corner of the figure."""

    left: float
    top: float
    right: float
    bottom: float


class Picture:
    """A panel, and where it lies in its figure."""

    under = first = True  # whether words stand below it, and to its left
    along = 0.0, 0.0  # between which its lower label has room

    def __init__(self, panel: PlotPanel, legend: bool) -> None:
        self.panel, self.box = panel, Box(0.0, 0.0, 1.0, 1.0)
        self.shapes = shapes_of(panel)
        self.others = shapes_of(panel.right) if panel.right else []
        everything = [*self.shapes, *self.others]
        self.x = Ruler.over(panel.x, [(s.x, s.based == "x") for s in everything])
        self.y = Ruler.over(panel.y, [(s.y, s.based == "y") for s in self.shapes])
        self.y2 = self.y
        if panel.right:
            self.y2 = Ruler.over(panel.right.y, [(s.y, False) for s in self.others])
        bars = (layer for layer in panel.layers if isinstance(layer, Bars))
        self.bars = next(bars, None)
        if self.bars:  # the first on top
            self.y = self.y._replace(low=self.y.high, high=self.y.low)
        self.entries = [s for s in everything if s.name and legend]
        self.rows: list[list[Shape]] = []  # of the legend

    def head(self, wide: float, beside: float = 0.0) -> float:
        """Return the height of what stands above the panel, in points.

        Long names of its legend may begin so many points `beside` it.
        """
        room = wide + beside - SAMPLE - 2 * GAP
        self.entries = [e._replace(name=fitted(e.name, room)) for e in self.entries]
        n, parts = len(self.entries), list[Integers]()
        widths = np.array([entry_width(entry) for entry in self.entries])
        for columns in range(n, 0, -1):  # as many as find room
            parts = np.array_split(np.arange(n), columns)
            if sum(widths[part].max() for part in parts) <= wide:
                break
        lines = range(len(parts[0]) if parts else 0)
        self.rows = [[self.entries[p[i]] for p in parts if i < len(p)] for i in lines]
        room = wide - sum(map(entry_width, self.rows[-1])) if self.rows else 0.0
        self.title_beside = width_of(self.panel.title) < room
        number = len(self.rows) + self._mark_lines(wide)
        number += bool(self.panel.title) and not self.title_beside
        return number * LINE + GAP * bool(number)

    def _mark_lines(self, wide: float) -> int:
        """Give the words of marks lines that keep them apart; return how many."""
        self.marks: list[tuple[Mark, float, int]] = []  # with places and lines
        ends = list[float]()  # how far the lines are written, the lowest first
        marks = [layer for layer in self.panel.layers if isinstance(layer, Mark)]
        for mark in sorted(marks, key=lambda mark: mark.value):
            part = float(self.x.part(np.array(self.panel.x.factor * mark.value)))
            half = width_of(mark.words) / 2 + GAP
            # not to the left of the panel, nor beyond the figure
            middle = max(min(wide * part, wide + self.room - half + GAP), half)
            free = (i for i, end in enumerate(ends) if middle - half >= end)
            line = next(free, len(ends))
            ends[line : line + 1] = [middle + half]
            self.marks.append((mark, middle / wide, line))
        return len(ends)

    @property
    def x_ticks(self) -> list[Tick]:
        """The numbers or words along the axis, as many as find room."""
        wide = self.box.right - self.box.left
        words = self.bars.words if self.bars else ()
        most = BETWEEN_WORDS if words else max(round(wide / APART[0]), 1)
        for number in range(most, 0, -1):
            ticks = self.x.ticks(number)
            room = wide / max(len(ticks), 1) - GAP
            if self.panel.x.words or all(width_of(t.words) < room for t in ticks):
                break
        return ticks

    def y_ticks(self, ruler: Ruler) -> list[Tick]:
        """Return the numbers or names along an upright axis."""
        if self.bars:
            names = self.bars.names
            parts = self.y.part(np.arange(len(names), dtype=float)).tolist()
            return [Tick(p, shortened(n)) for p, n in zip(parts, names, strict=True)]
        high = self.box.bottom - self.box.top
        ticks = ruler.ticks(min(max(round(high / APART[1]), 1), MOST_TICKS))
        if ruler.axis.scale != "normal":
            return ticks
        kept = list[Tick]()  # from the middle on, where they do not touch
        for tick in sorted(ticks, key=lambda tick: abs(tick.part - 0.5)):
            if all(abs(tick.part - other.part) * high >= SIZE for other in kept):
                kept.append(tick)
        return kept

    @property
    def below(self) -> float:
        """The height of the words along the axis."""
        words = [tick.words for tick in self.x.ticks(1)] if self.panel.x.words else []
        return GAP + max([LINE, *(width_of(wrapped(w)) for w in words)])

    @property
    def beside(self) -> float:
        """The width of the words to the left."""
        lines = len(self.label(self.panel.y.label))
        words = (tick.words for tick in self.y_ticks(self.y))
        return LINE * lines + 2 * GAP + max(map(width_of, words), default=0.0)

    @property
    def room(self) -> float:
        """The width of the words to the right."""
        words = [*self.bars.words] if self.bars else []
        if self.panel.right:
            words += [f"{tick.words}MM" for tick in self.y_ticks(self.y2)]
        half = max((width_of(tick.words) / 2 for tick in self.x.ticks(3)), default=0.0)
        beside = 2 * GAP + max(map(width_of, words), default=0.0)
        return beside if self.panel.x.words else max(beside, half)

    @property
    def lower_label(self) -> tuple[float, str]:
        """What is along the axis, in a line below it, and the place of its middle."""
        start, end = self.along
        words = fitted(self.panel.x.label, end - start)
        half = width_of(words) / 2
        middle = (self.box.left + self.box.right) / 2
        return max(min(middle, end - half), start + half), words

    def label(self, words: str) -> list[str]:
        """Return words along an upright axis, in as many lines as they need."""
        high = self.box.bottom - self.box.top
        letters = high / width_of(words) * len(words) if words else 1
        return wrap(words, max(int(letters), 1))


def entry_width(entry: Shape) -> float:
    """Return the width of an entry of a legend, with the room behind it."""
    return SAMPLE + 4 * GAP + width_of(entry.name)


def fitted(words: str, room: float) -> str:
    """Return words of at most so many points; long ones lose their middle."""
    short, end = words, len(words) // 2
    while end > 1 and width_of(short) > room:
        end -= 1
        short = f"{words[:end]}…{words[-end:]}"
    return short


def wrapped(name: str) -> str:
    """Return a name in lines, short enough to leave room for the picture."""
    return "\n".join(wrap(visible(name), NAME))


def shortened(name: str) -> str:
    """Return a name, of a long one both ends: the page has all of it."""
    name = visible(name)
    end = LONGEST // 2
    return name if len(name) <= LONGEST else f"{name[:end]}…{name[1 - end :]}"
