"""The share of units with a property, from trials that were thinned.

Trials are drawn as always, and evaluated with a chance that past trials choose. An
evaluated trial stands for one over its chance. So each drawn trial is expected to count
as the share, whatever the model and the distributions are. Of a rare property drawn
trials without a chance count as if they had it not.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array, Integers, Truths
from tolstat.statistics.estimate import CONFIDENCE, Estimate
from tolstat.statistics.intervals.shares import evidence_against
from tolstat.statistics.intervals.weights import Thinned

# bets that the share is less, as parts of the greatest that cannot ruin, and bets that
# it is more; how much of the capital bets each
STAKES = np.array([0.01, 0.03, 0.06, 0.12, 0.25, 0.5, 0.75, 0.95])
ON_LESS = np.log([0.02, 0.03, 0.05, 0.1, 0.15, 0.2, 0.2, 0.25])
BETS = np.array([0.015, 0.03, 0.06, 0.12, 0.25, 0.5, 1.0, 2.0])
ON_MORE = np.log([0.05, 0.1, 0.15, 0.2, 0.2, 0.15, 0.1, 0.05])
HALVINGS = 40  # of an interval between two shares
BELOW_ONE = 1 - 2.0**-53
NEVER = -1e9  # log evidence of a bet that lost everything


class Stages(NamedTuple):
    """Drawn trials by stage, and what those with a property count.

    Attributes
    ----------
    drawn, most : float64[stage]
        Number of drawn trials; the most that one of them could count.
    stage : int64[unit]
        Stage of each unit with the property.
    counts : float64[unit]
        What each of them counts.
    """

    drawn: Array
    most: Array
    stage: Integers
    counts: Array

    @property
    def share(self) -> float:
        """The share of all drawn trials."""
        return float(self.counts.sum() / self.drawn.sum())

    @property
    def error(self) -> float:
        """Standard error of the share, about."""
        n = self.drawn.sum()
        return math.sqrt(max(float(np.sum(self.counts**2)) / n - self.share**2, 0) / n)

    def evidence(self, share: float, side: int) -> float:
        """Return the largest log evidence that the true share is not this one.

        That it is more (side 1), or less (-1). The first stage bets as
        `evidence_against`, each later one with fixed parts of the capital. Whatever the
        units are, it ever exceeds log(k) with a probability of at most 1/k.
        """
        plain, count = int(self.drawn[0]), int(np.count_nonzero(self.stage == 0))
        if side < 0:
            first = evidence_against(count, plain, share)
        else:
            others = min(1 - share, BELOW_ONE)
            first = evidence_against(plain - count, plain, others)
        later = self.stage > 0
        if side < 0:
            bets, parts = STAKES / (self.most[1:, None] - share), ON_LESS
        else:
            safe = np.minimum(BETS, STAKES[-1] / share)
            bets = np.broadcast_to(safe, (len(self.drawn) - 1, len(safe)))
            parts = ON_MORE
        stage = self.stage[later] - 1
        counted = np.bincount(stage, minlength=len(bets))
        gains = np.log1p(-side * bets * share) * (self.drawn[1:] - counted)[:, None]
        won = np.log1p(side * bets[stage].T * (self.counts[later] - share))
        for bet, gains_of_units in enumerate(won):
            gains[:, bet] += np.bincount(stage, gains_of_units, minlength=len(bets))
        capital = np.logaddexp.reduce(np.cumsum(gains, axis=0) + parts, axis=1)
        return max(first, NEVER) + float(np.max(capital, initial=0.0))


def counted_stages(units: Truths, thinned: Thinned) -> Stages:
    """Return what units with a property count, by stage."""
    last = thinned.ends - 1
    stage = np.searchsorted(last, np.flatnonzero(units))
    drawn = np.diff(thinned.drawn[last], prepend=0.0)
    most = 1 / np.abs(thinned.least[last])
    return Stages(drawn, most, stage, 1 / thinned.chance[units])


def thinned_share(
    units: Truths, thinned: Thinned, confidence: float = CONFIDENCE
) -> Estimate:
    """Estimate the share of units with a property, with an anytime-valid interval.

    Parameters
    ----------
    units : bool[trial]
        Which evaluated trials have the property. If these are most of them, the value
        is 1 less the share of the others.

    Returns
    -------
    Estimate
        Its interval holds after every stage, for any distribution: each side errs with
        at most half of 1 - confidence. Without a second stage it is `anytime_valid`.

    References
    ----------
    D. G. Horvitz, D. J. Thompson, A generalization of sampling without replacement, J.
    Am. Stat. Assoc. 47 (1952) 663-685. I. Waudby-Smith, A. Ramdas, Estimating means of
    bounded random variables by betting, J. R. Statist. Soc. B 86 (2024) 1-27.
    """
    if 2 * np.count_nonzero(units) > len(units):
        return thinned_share(~units, thinned, confidence).complement
    stages, needed = counted_stages(units, thinned), _needed(confidence)
    value = min(stages.share, 1.0)
    ends = []
    for side, excluded in ((1, 0.0), (-1, 1.0)):
        possible = value
        for _ in range(HALVINGS if possible != excluded else 0):
            middle = (possible + excluded) / 2
            if stages.evidence(middle, side) >= needed:
                excluded = middle
            else:
                possible = middle
        ends.append(excluded)
    return Estimate(value, min(ends[0], value), max(ends[1], value))


def is_settled(units: Truths, thinned: Thinned, share: float) -> bool:
    """Return whether the interval of `thinned_share` excludes a share."""
    stages = counted_stages(units, thinned)
    side = 1 if stages.share > share else -1
    return stages.evidence(share, side) >= _needed()


def trials_settling(units: Truths, thinned: Thinned, share: float) -> float:
    """Return how many evaluated trials are likely to tell a share from another one.

    Evidence is assumed to grow as it did; infinite while there is none.
    """
    stages = counted_stages(units, thinned)
    side = 1 if stages.share > share else -1
    evidence = stages.evidence(share, side)
    return len(units) * _needed() / evidence if evidence > 0 else math.inf


def _needed(confidence: float = CONFIDENCE) -> float:
    """Return the log evidence that excludes a share."""
    return math.log(2 / (1 - confidence))
