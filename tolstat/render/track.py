"""Intervals against a level: places along a logarithmic axis, for a page."""

from __future__ import annotations

import math
from typing import NamedTuple

from tolstat.document.blocks import Ranges

MOST_DECADES = 5
FEW = 10  # rows
BELOW = 0.07  # of the axis, linear from 0 to its first power of ten


class Row(NamedTuple):
    """A name, and places in % of the axis."""

    name: str
    at: float
    ends: tuple[float, float] | None  # from the left, from the right; None: no interval
    level: float
    tone: str  # a class of the style sheet
    reason: str  # why there is no interval


class Track(NamedTuple):
    """The rows, the powers of ten along the axis, and the one level that all share."""

    rows: tuple[Row, ...]
    ticks: tuple[tuple[float, str], ...]
    level: tuple[float, str] | None
    look: str  # a class of the style sheet: many rows are narrow ones


def track_of(ranges: Ranges) -> Track:
    """Return the places of some intervals; the axis begins at 0 and ends above all."""
    times = ranges.scale.factor
    levels = {times * each.level for each in ranges.rows}
    seen = [times * x for each in ranges.rows for x in (each.found[0], each.found[2])]
    seen = [x for x in (*seen, *levels, *(x / 100 for x in levels)) if 0 < x < math.inf]
    last = math.ceil(math.log10(max(seen)) - 1e-9)
    first = max(math.floor(math.log10(min(seen))), last - MOST_DECADES)

    def place(x: float) -> float:
        part = BELOW * x / 10.0**first
        if part > BELOW:
            part = BELOW + (1 - BELOW) * (math.log10(x) - first) / (last - first)
        return round(100 * min(max(part, 0.0), 1.0), 2)

    rows = []
    for each in ranges.rows:
        at, ends, (value, lower, upper, reason) = 0.0, None, each.found
        if each.found.sure:
            at = place(times * value)
            ends = place(times * lower), round(100 - place(times * upper), 2)
        level = place(times * each.level)
        tone = each.tone.replace(" ", "-")
        rows.append(Row(each.name, at, ends, level, tone, reason))
    powers = [10.0**power for power in range(first, last + 1)]
    ticks = [(place(power), f"{power:.10g}") for power in powers]
    least = min(levels)
    shared = (place(least), f"{ranges.level} {least:.4g}")
    one = shared if len(levels) == 1 else None
    look = " many" if len(rows) > FEW else ""
    return Track(tuple(rows), ((0.0, "0"), *ticks), one, look)
