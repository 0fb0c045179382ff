"""Small histograms of limited responses."""

import numpy as np

from tolstat.arrays import Array
from tolstat.document.blocks import Sketch
from tolstat.statistics.limits.limit import Limit
from tolstat.units.scale import Scale

BARS = 24
LEAST_HEIGHT = 0.06  # of a bar with a single trial: it is to be seen
CENTRAL = 0.005, 0.995  # of the trials; what lies outside is in the bars at the ends


def sketch_of(name: str, values: Array, limit: Limit, scale: Scale) -> Sketch | None:
    """Return the histogram of a response with a limit, SI; None without a spread."""
    values = values[np.isfinite(values)]
    if not len(values) or not np.ptp(values) > 0:
        return None
    lower, upper = (float(x) for x in np.quantile(values, CENTRAL))
    ends = [end for end in limit.finite if values.min() < end < values.max()]
    lower, upper = min([lower, *ends]), max([upper, *ends])
    if not upper > lower:
        lower, upper = float(values.min()), float(values.max())
    edges = np.linspace(lower, upper, BARS + 1)
    for end in ends:  # a bar is within the limit, or out of it
        edges[np.abs(edges - end).argmin()] = end
    counts = np.histogram(np.clip(values, lower, upper), edges)[0]
    heights = counts / counts.max()
    heights[counts > 0] = np.maximum(heights[counts > 0], LEAST_HEIGHT)
    middle = (edges[1:] + edges[:-1]) / 2
    out = (middle < limit.lower) | (middle > limit.upper)
    words = f"{scale.words(float(values.min()))} to {scale.words(float(values.max()))}"
    return Sketch(
        f"Histogram of {name}: {words}", tuple(edges.tolist()),
        tuple(heights.tolist()), tuple(out.tolist()), tuple(limit.finite),
    )  # fmt: skip
