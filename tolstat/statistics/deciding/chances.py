"""Chances with which drawn trials are evaluated: small where their side is clear.

A quadratic surface ranks trials by how near a limit they are. Trials of a rank are
evaluated the more often, the more of their rank were out of limit. The rank alone
counts: so a response with a point mass, which no surface follows, can be ranked.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array, Truths
from tolstat.statistics.deciding.thinned_share import counted_stages
from tolstat.statistics.intervals.weights import Thinned
from tolstat.statistics.limits.limit import Limit, margins, within
from tolstat.statistics.remedies.surface import fitted_surface

HALVES = 2  # each ranks the trials that the other one's surface was fitted to
MOST_FITTED = 8192  # trials of a surface
LEAST_FITTED = 200
NEAR = 0.5  # of sigma: so far from the limit a trial counts half in the fit
# parts of all trials, by their rank: from the first to the next one
RANKS = np.array([0.002, 0.004, 0.008, 0.016, 0.03, 0.06, 0.12, 0.25, 0.5])
TIMES = 2.0  # the root of the rate out of limit, as a chance
LEAST_CHANCE = 0.005, 0.01  # of a limit that seems missed; met
COVERED = 0.5  # part of the distance to the permitted share, as a chance
LEAST_DISTANCE = 0.25, 0.02  # of the distance, without its error; of what is permitted
# trials far from a limit get no chance: the worst ones so far, how much farther than
# these ranks count, how much farther than the permitted part; the largest part by then
WORST, SAFETY, TIMES_PERMITTED, FARTHEST = 20, 2.0, 4.0, 0.12


class Ranking(NamedTuple):
    """Surfaces that rank trials by how near the limit of a response they are.

    Attributes
    ----------
    scores : function
        Of float64[trial, contributor] to float64[trial], the mean of both surfaces.
    by_other : float64[trial]
        Scores of the trials so far, each by the surface not fitted to it.
    """

    scores: Callable[[Array], Array]
    by_other: Array

    @classmethod
    def fitted(cls, deviations: Array, values: Array, limit: Limit) -> Ranking | None:
        """Fit surfaces to the trials that are done; None if these are too few."""
        done = np.flatnonzero(np.isfinite(values))
        if len(done) < HALVES * LEAST_FITTED:
            return None
        spread = deviations.std(axis=0)
        varying = spread > 0
        z = deviations[:, varying] / spread[varying]
        margin = margins(values, limit.permitted)
        counted = 1 / (1 + (margin / (NEAR * values[done].std() or 1.0)) ** 2)
        surfaces = []
        for half in range(HALVES):
            rows = done[half::HALVES]
            rows = rows[:: -(-len(rows) // MOST_FITTED)]
            fit = fitted_surface(z[rows], values[rows, None], counted[rows])
            gains = fit.along(np.zeros((1, z.shape[1])), np.arange(z.shape[1]))
            level = np.average(
                values[rows] - gains(z[rows]).both[:, 0], weights=counted[rows]
            )
            surfaces.append((gains, level))

        def score(z: Array, half: int) -> Array:
            gains, level = surfaces[half]
            return -margins(level + gains(z).both[:, 0], limit.permitted)

        by_other = np.empty(len(z))
        for half in range(HALVES):
            by_other[half::HALVES] = score(z[half::HALVES], 1 - half)

        def scores(trials: Array) -> Array:
            z = trials[:, varying] / spread[varying]
            means: Array = np.mean([score(z, half) for half in range(HALVES)], axis=0)
            return means

        return cls(scores, by_other)

    def of_more(self, deviations: Array) -> Ranking:
        """Return the same surfaces with the scores of more trials."""
        more = self.scores(deviations[len(self.by_other) :])
        return self._replace(by_other=np.append(self.by_other, more))


class Chances(NamedTuple):
    """The chances of a stage for one limit.

    Attributes
    ----------
    ranking : Ranking
        Scores of trials.
    edges : float64[rank]
        Scores at which ranks end, ascending.
    chance : float64[rank + 1]
        By rank, the last one nearest to the limit.
    """

    ranking: Ranking
    edges: Array
    chance: Array

    def of_trials(self, deviations: Array) -> Array:
        """Return the chance of each trial."""
        ranks = np.searchsorted(self.edges, self.ranking.scores(deviations))
        return np.asarray(self.chance[ranks])


def chances(
    ranking: Ranking, out: Truths, thinned: Thinned, permitted: float
) -> Chances:
    """Return the chances with which the next trials are evaluated.

    `out` are the trials out of limit so far, `permitted` is the permitted share.
    """
    scores = ranking.by_other
    edges = np.quantile(scores[: thinned.plain], 1 - RANKS[::-1])
    ranks = np.searchsorted(edges, scores)
    trials = np.bincount(ranks, minlength=len(edges) + 1)
    count = np.bincount(ranks[out], minlength=len(edges) + 1)
    # a rank nearer to the limit is not clearer
    rate = np.maximum.accumulate(count / (trials + 1))
    least = _least_chance(out, thinned, permitted)
    return Chances(ranking, edges, np.clip(TIMES * np.sqrt(rate), least, 1.0))


def near_chances(
    ranking: Ranking, margins: Array, thinned: Thinned, permitted: float
) -> Chances | None:
    """Return chances that leave out trials far from a limit; None if ranks are unsure.

    All drawn trials are evaluated that rank as near as the worst trials so far do, or
    as a part of them that is some times the permitted one. So each stage draws more,
    and leaves out more, as in subset simulation.

    Parameters
    ----------
    margins : float64[trial]
        How far the trials so far are within the limit, below 0 out of it.
    """
    scores, units = ranking.by_other, 1 / thinned.chance
    worst = max(WORST, np.count_nonzero(margins < 0))
    reach = scores[np.argsort(margins)[:worst]].min()
    drawn = thinned.drawn[-1]
    part = float(units[scores >= reach].sum() / drawn)
    part = max(SAFETY * part, TIMES_PERMITTED * permitted)
    if part > FARTHEST:
        return None
    nearest = np.argsort(-scores)
    last = np.searchsorted(np.cumsum(units[nearest]), part * drawn)
    edges = scores[nearest[[min(int(last), len(scores) - 1)]]]
    return Chances(ranking, edges, np.array([0.0, 1.0]))


def _least_chance(out: Truths, thinned: Thinned, permitted: float) -> float:
    """Return the chance of trials whose side is clear.

    A limit is met only if few of these are out of it: they are evaluated as often as
    the distance of the share from the permitted one needs.
    """
    stages, fewest = counted_stages(out, thinned), 0.5 / permitted
    drawn = float(stages.drawn.sum())
    share = (stages.share * drawn + 0.5) / (drawn + fewest)
    error = max(stages.error, (0.2 * permitted / drawn) ** 0.5)
    missed, met = LEAST_CHANCE
    if share >= permitted + error:
        return missed
    part, least = LEAST_DISTANCE
    distance = abs(share - permitted)
    distance = max(distance - error, part * distance, least * permitted)
    chance = COVERED * distance / max(share, 0.1 * permitted)
    return float(np.clip(chance, met, 1.0))


def evaluated_part(
    deviations: Array, values: Array, done: Truths, limit: Limit
) -> float:
    """Return how many evaluated trials decide a limit, over as many plain ones.

    By the chances of the first thinned stage; 1 where no surface ranks trials.
    Arguments as of `Ranking.fitted` and `out_of_limit`.
    """
    ranking = Ranking.fitted(deviations, values, limit)
    if ranking is None:
        return 1.0
    out, one = out_of_limit(values, done, limit), np.ones(len(values))
    chosen = chances(
        ranking, out, Thinned(one, len(one) * one, one), 1 - limit.demanded
    )
    chance = chosen.chance[np.searchsorted(chosen.edges, ranking.by_other)]
    # units out of limit count one over their chance: so the variance of a share grows
    variance = np.mean(1 / chance[out]) if out.any() else 1.0
    return min(float(chance.mean() * variance), 1.0)


def out_of_limit(values: Array, done: Truths, limit: Limit) -> Truths:
    """Return which trials are out of a limit; failed ones are."""
    return ~(within(values, limit.permitted) & done)
