"""Intervals as tables: what a page reads its numbers from."""

from typing import Any

import numpy as np
from scipy.special import gammaincinv, log_ndtr, ndtr

from tolstat.answers.explore.packed import packed
from tolstat.deviations import density_ratio
from tolstat.statistics.estimate import CONFIDENCE
from tolstat.statistics.intervals.shares import anytime_valid
from tolstat.statistics.intervals.weights import LEAST_EFFECTIVE

EVERY = 8  # of the normal scores of a density: 513 stay
COUNTED = 160  # counts up to here are all tabulated, and as many larger ones
MOST_UNITS = 4096  # new units by which a page caps weights
LAST_DECADE, PER_DECADE = 7, 40  # of the shapes of a gamma distribution


def interval_tables(trials: int) -> dict[str, Any]:
    """Return the tables for a run of so many trials.

    Intervals of counts, factors of the interval of weighted counts, areas below and
    around normal scores, and from where on weighted trials are not trusted.
    """
    first = np.arange(min(trials, COUNTED) + 1)
    larger = np.geomspace(max(len(first) - 1, 1), trials, COUNTED)
    counts = np.unique(np.concatenate([first, larger.round()])).astype(int)
    shares = [anytime_valid(int(count), trials) for count in counts]
    scores = density_ratio.SCORES[::EVERY]
    areas = np.pad(ndtr(scores), 1, "edge")
    shapes = np.logspace(0, LAST_DECADE, LAST_DECADE * PER_DECADE + 1)
    miss = (1 - CONFIDENCE) / 2
    return {
        "anytime": {
            "counts": counts.tolist(),
            "lower": [share.lower for share in shares],
            "upper": [share.upper for share in shares],
        },
        "gamma": {
            "lower": (gammaincinv(shapes, miss) / shapes).tolist(),
            "upper": (gammaincinv(shapes, 1 - miss) / shapes).tolist(),
            "last": LAST_DECADE,
        },
        "log_areas": packed(log_ndtr(scores), "f8"),
        "masses": packed(0.5 * (areas[2:] - areas[:-2]), "f8"),
        "farthest": density_ratio.FARTHEST,
        "least_effective": LEAST_EFFECTIVE,
        "most_uncovered": density_ratio.MOST_UNCOVERED,
        "heaviest": [density_ratio.HEAVIEST_SHARE, density_ratio.MOST_HEAVIEST],
        "none_met": density_ratio.NONE_MET,
        "most_units": MOST_UNITS,
    }
