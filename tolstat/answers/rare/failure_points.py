"""The most probable failure points, and which of their parts lie far out."""

from collections.abc import Mapping
from itertools import islice
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, ndtri

from tolstat.deviations.rare_stage import DISTANCE
from tolstat.store.run_records import SCORES, Assumed
from tolstat.store.stored_run import Run

MOST_POINTS = 10  # named
LEADING = 0.5  # times as far out as the farthest contributor: named too
NORMAL = 0.01  # between its sigmas and its normal score: taken as normal


class FailurePoint(NamedTuple):
    """An out-of-limit trial, of those that are most probable."""

    trial: int
    value: float  # of the response, SI; NaN where it failed
    distance: float  # from the median trial, in normal scores: how many sigmas off
    deviations: Mapping[str, float]  # by contributor that deviates, SI
    off: Mapping[str, float]  # the same in sigmas of its distribution, from its mean
    # the same as normal scores: as unlikely as so many sigmas of a normal part
    scores: Mapping[str, float]
    # share of its distribution that lies farther out, to the same side
    farther: Mapping[str, float]

    @property
    def leading(self) -> list[str]:
        """The contributors that lie far out, the farthest first.

        By normal scores: a uniform part at its very end is 1.7 sigmas off, and as
        unlikely there as a normal one at four.
        """
        far = {name: abs(score) for name, score in self.scores.items()}
        least = LEADING * max(far.values(), default=0.0)
        return sorted((n for n in far if far[n] >= least), key=lambda name: -far[name])

    def normal(self, name: str) -> bool:
        """Tell whether a deviation is as unlikely as its sigmas say."""
        return abs(self.off[name] - self.scores[name]) < NORMAL


def failure_points(run: Run, out: NDArray[np.bool_]) -> tuple[FailurePoint, ...]:
    """Return the trials among bool[trial] that are nearest to the median trial.

    A trial that repeats another is left out.
    """
    trials = np.flatnonzero(out)
    distances, first = np.unique(run.column(DISTANCE)[trials], return_index=True)
    nearest = zip(trials[first].tolist(), distances.tolist(), strict=True)
    return tuple(_point(run, *each) for each in islice(nearest, MOST_POINTS))


def _point(run: Run, trial: int, distance: float) -> FailurePoint:
    deviations = {name: float(run.column(name)[trial]) for name in run.assumed}
    off = {
        name: (deviations[name] - each.mean) / each.sigma
        for name, each in run.assumed.items()
        if each.sigma > 0
    }
    scores = {name: normal_score(deviations[name], run.assumed[name]) for name in off}
    farther = {name: float(ndtr(-abs(score))) for name, score in scores.items()}
    value = float(run.column(run.aim)[trial])
    return FailurePoint(trial, value, distance, deviations, off, scores, farther)


def normal_score(deviation: float, assumed: Assumed) -> float:
    """Return how unlikely it is that a part lies as far out, as a normal score."""
    at = np.array(assumed.at_scores)
    first, behind = (int(np.searchsorted(at, deviation, s)) for s in ("left", "right"))
    if first < behind:  # of many equal parts the one that is least far out
        return float(np.clip(0.0, SCORES[first], SCORES[behind - 1]))
    if first in (0, len(at)):
        return float(SCORES[min(first, len(at) - 1)])
    # between two: shares, not scores, go evenly along a density without a slope
    side = 1.0 if SCORES[first - 1] >= 0 else -1.0
    shares = ndtr(-side * SCORES[first - 1 : first + 1])
    share = np.interp(deviation, at[first - 1 : first + 1], shares)
    return float(-side * ndtri(share))
