"""Old names, until allocate has moved."""

from __future__ import annotations

import math

from tolstat.statistics.estimate import Estimate
from tolstat.units.scale import Scale

# a text, or a number with the ends of its interval
Cell = str | tuple[str, str, str]


def estimate_in_words(estimate: Estimate, scale: Scale) -> Cell:
    """Write an estimate with its interval, or why it has none.

    Of one that is nothing to an engineer the interval says nothing more.
    """
    value, lower, upper = scale.interval(*estimate[:3])
    if estimate.sure and math.isinf(estimate.upper):
        return f"at least {lower}"
    if estimate.sure and math.isinf(estimate.lower):
        return f"at most {upper}"
    if math.isinf(estimate.value):
        return "no interval"
    if estimate.sure:
        nothing = estimate.value and scale.nothing(max(map(abs, estimate[:3])))
        return value if nothing else (value, lower, upper)
    if estimate.needs_more:
        return estimate.reason
    return f"{value}: no interval"
