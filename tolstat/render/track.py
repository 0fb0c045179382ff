"""Places along the logarithmic axis of intervals against a level, for a page."""

import math

from tolstat.document.blocks import Ranges

MOST_DECADES = 5
BELOW = 0.07  # of the axis, linear from 0 to its first power of ten


class Track:
    """An axis from 0 to above all values; `ticks`: its numbers, as shown."""

    def __init__(self, ranges: Ranges) -> None:
        self.times, rows = ranges.scale.factor, ranges.rows
        levels = [self.times * row.level for row in rows]
        seen = [self.times * x for row in rows for x in (row.found[0], row.found[2])]
        seen = [x for x in (*seen, *levels, min(levels) / 100) if 0 < x < math.inf]
        self.last = math.ceil(math.log10(max(seen)) - 1e-9)
        first = math.floor(math.log10(min(seen)))
        self.first = max(first, self.last - MOST_DECADES)
        powers = range(self.first, self.last + 1)
        self.ticks = (0.0, *(10.0**power for power in powers))
        self.shared = f"{ranges.level} {min(levels):.4g}" if len({*levels}) == 1 else ""

    def percent(self, value: float) -> float:
        """Return where a value, SI, lies: in % of the axis."""
        x = self.times * value
        part = BELOW * x / 10.0**self.first
        if part > BELOW:
            decades = (math.log10(x) - self.first) / (self.last - self.first)
            part = BELOW + (1 - BELOW) * decades
        return round(100 * min(max(part, 0.0), 1.0), 2)
