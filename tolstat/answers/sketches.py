"""Small histograms of limited responses."""

import numpy as np

from tolstat.answers.report.response_figures import bars_of
from tolstat.arrays import Array
from tolstat.document.blocks import Sketch
from tolstat.statistics.limits.limit import Limit
from tolstat.units.scale import Scale

BARS = 30
LEAST_HEIGHT = 0.06  # of a bar, so that a single trial is seen


def sketch_of(name: str, values: Array, limit: Limit, scale: Scale) -> Sketch | None:
    """Return the histogram of a response with a limit, SI; None without values."""
    if not len(values):
        return None
    bars = bars_of(values, limit.permitted, 1.0, BARS)
    top = max(float(layer.heights.max()) for layer in bars)
    heights = np.sum([layer.heights for layer in bars], axis=0) / top
    heights[heights > 0] = np.maximum(heights[heights > 0], LEAST_HEIGHT)
    edges = bars[0].edges
    out = (edges[1:] <= limit.lower) | (edges[:-1] >= limit.upper)
    words = f"{scale.words(float(values.min()))} to {scale.words(float(values.max()))}"
    return Sketch(
        f"Histogram of {name}: {words}", tuple(edges.tolist()),
        tuple(heights.tolist()), tuple(out.tolist()), tuple(limit.finite),
    )  # fmt: skip
