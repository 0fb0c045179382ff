"""Old drawing, until compare has moved."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray
from scipy.special import ndtri

from tolstat.answers.report.response_figures import MOST_DRAWN, edges_of, ends_of
from tolstat.render.page_picture import BEYOND
from tolstat.statistics.summary import Summary

__all__ = ["edges_of", "mark_limit", "scale_of_probability", "spread_out"]

DRAWN_POINTS = MOST_DRAWN
TICKS = (1e-6, 1e-5, 1e-4, 1e-3, 0.01, 0.1, 0.5)


def mark_limit(axes: Axes, found: Summary, scale: float) -> None:
    """Mark the ends of the limit across the picture, with its words in the legend."""
    label = f"limit {found.limited.limit.words}" if found.limited else ""
    for end in ends_of(found):
        axes.axvline(
            scale * end, color=BEYOND, linestyle="--", linewidth=1.2, label=label
        )
        label = "_unnamed"


def scale_of_probability(axes: Axes, least: float) -> None:
    """Write shares of the machines on an axis of normal scores, down to the least."""
    ticks = [t for t in TICKS if t >= least / 2]
    ticks = sorted({*ticks, *(1 - t for t in ticks)})
    axes.set_yticks(ndtri(ticks), [f"{100 * t:.10g}" for t in ticks])
    axes.set_ylabel("% of the machines below")


def spread_out(n: int) -> NDArray[np.int64]:
    """Choose points of a distribution function: all in the tails, few in the middle."""
    if n <= DRAWN_POINTS:
        return np.arange(n)
    tail = np.unique(np.geomspace(1, n // 2, DRAWN_POINTS // 2).astype(np.int64))
    return np.unique(np.concatenate([tail - 1, n - tail]))
