"""Weights of trials, and bets on a mean for any distribution between two ends.

A weighted trial stands for units of another distribution.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array, Integers, Truths
from tolstat.statistics.estimate import CONFIDENCE, Lack, NoInterval

LEAST_EFFECTIVE = 150  # with fewer, one heavy trial dominates


@dataclass(eq=False)
class Weights:
    """How many units each trial stands for, one on average.

    Parameters
    ----------
    values : float64[trial]
        Density of each trial in the new distributions over that in the sampled ones.
    most : float, optional
        Cap of the weights in intervals, chosen independently of the trials; the largest
        weight if not given.
    cut : float
        Greatest share of the new units above the cap: in intervals they may lie
        anywhere.
    uncovered : float
        Greatest share of the new units that no trial stands for.
    searched : bool
        Whether trials with the property in question were searched: their own weights
        limit their share.
    """

    values: Array
    most: float = math.nan
    cut: float = 0.0
    uncovered: float = 0.0
    searched: bool = False

    def __post_init__(self) -> None:
        """Take the largest weight as the cap where none is given."""
        if math.isnan(self.most):
            self.most = float(self.values.max())

    @cached_property
    def capped(self) -> Array:
        """Weights in intervals: float64[trial]."""
        return np.minimum(self.values, self.most)

    @cached_property
    def so_far(self) -> Array:
        """One more than the units up to each trial: float64[trial]."""
        return np.cumsum(self.capped) + 1

    @cached_property
    def number(self) -> int:
        """Effective sample size; 0 of none."""
        return effective_number(self.values)

    @property
    def too_few(self) -> NoInterval | None:
        """Return that the effective sample size is too small; None if it is enough."""
        if self.number >= LEAST_EFFECTIVE:
            return None
        return NoInterval(
            Lack.EFFECTIVE_TRIALS, effective=self.number, needed=LEAST_EFFECTIVE
        )

    def part(self, trials: Integers) -> Weights:
        """Return the weights of some trials, in order, chosen independently of them."""
        return replace(self, values=self.values[trials])

    def selected(self, trials: Truths) -> Weights:
        """Return the weights of a selection; all units above the cap may be in it."""
        inverse = len(trials) / max(int(np.count_nonzero(trials)), 1)
        return replace(
            self, values=self.values[trials], cut=self.cut * inverse,
            uncovered=self.uncovered * inverse,
        )  # fmt: skip


# columns of a run whose trials were thinned; no response can have these names
COLUMNS = {
    "thinned-chance": "chance that the trial was evaluated",
    "thinned-drawn": "trials drawn until the end of its stage",
    "thinned-least": "least chance of its stage; below 0: trials far from limits had "
    "none",
}
RARE = 200e-6  # a limit that permits less is judged without trials far from it


class Thinned(NamedTuple):
    """How trials were thinned: float64[trial] each, in the order of their stages.

    Attributes
    ----------
    chance : float64[trial]
        That a trial of the sample was evaluated.
    drawn : float64[trial]
        Trials drawn until the end of the stage of a trial. The first stage has as many
        trials as it drew.
    least : float64[trial]
        Least chance of the stage, chosen before it; negative if trials that are far
        from all limits had no chance.
    """

    chance: Array
    drawn: Array
    least: Array

    @property
    def plain(self) -> int:
        """Number of trials of the first stage, all of which were evaluated."""
        return int(self.drawn[0])

    @property
    def units(self) -> Array:
        """Drawn trials that each stands for; 0 in stages that leave out trials."""
        return np.where(self.least > 0, 1 / self.chance, 0.0)

    @property
    def ends(self) -> Integers:
        """Numbers of evaluated trials at the end of each stage, int64[stage]."""
        return np.append(np.flatnonzero(np.diff(self.drawn)) + 1, len(self.drawn))

    @property
    def covering(self) -> int:
        """Number of the first trials, in whose stages each trial had a chance."""
        skipping = np.flatnonzero(self.least < 0)
        return int(skipping[0]) if len(skipping) else len(self.least)

    @property
    def skips(self) -> bool:
        """Whether later stages leave out trials far from all limits."""
        return self.covering < len(self.least)

    @property
    def unseen(self) -> float:
        """The largest share of units of a kind that no trial of the first stage is of.

        A larger one is missed with a chance of at most 2.5 %.
        """
        return -math.expm1(math.log((1 - CONFIDENCE) / 2) / self.plain)

    def in_whole_stages(self, trials: int) -> int:
        """Return how many of the first trials are those of whole stages."""
        ends = self.ends
        return int(ends[ends <= trials].max(initial=0))

    def first(self, trials: int) -> Thinned:
        """Return the first trials, which are whole stages."""
        return Thinned(*(values[:trials] for values in self))


def effective_number(weights: Array) -> int:
    """Return the effective sample size of float64[trial] weights.

    References
    ----------
    L. Kish, Survey Sampling, Wiley 1965, 11.7.
    """
    squares = float(np.sum(weights**2))
    return round(float(weights.sum()) ** 2 / squares) if squares > 0 else 0


MOST_STAKED = 0.75  # of the capital in one bet, at most: no bet ruins
PRECISION = 1e-6  # of an end, relative


def mean_between(
    values: Array,
    lower: float,
    upper: float,
    confidence: float = 0.95,
    weights: Weights | None = None,
) -> tuple[float, float]:
    """Return bounds of a mean, for any distribution between two ends.

    A gambler bets in each trial that the mean is more than m, with a stake that the
    earlier trials suggest. If the mean is m, the capital grows by 2/(1 - confidence)
    with at most half the error probability. The interval holds each m at which neither
    this gambler nor one who bets on less gains that much. It assumes no moment, no
    shape and no number of trials. Of a normal distribution it is 1.4 times as wide as
    Student's with near ends. With ends at 16 sigmas it is 2.6 times as wide at 200
    trials and 1.4 times at 10 000.

    Parameters
    ----------
    values : float64[n]
        Independent, none NaN, in an order independent of their size.
    weights : Weights, optional
        The mean is then that of the units that the values stand for. A bet pays the
        weight times value less m, whose mean is zero if the mean is m. All units above
        the cap may lie at the near end.

    References
    ----------
    I. Waudby-Smith, A. Ramdas, Estimating means of bounded random variables by betting,
    J. R. Statist. Soc. B 86 (2024) 1-27: the capitals of (23) to (26), each by itself.
    """
    miss = (1 - confidence) / 2
    least = least_mean(values, lower, miss, weights)
    return least, -least_mean(-values, -upper, miss, weights)


def least_mean(
    values: Array, lower: float, miss: float, weights: Weights | None = None
) -> float:
    """Return a lower bound of the mean; the distribution has no upper end.

    The bound lies above the mean with a probability of at most `miss`.
    """
    from scipy.optimize import brentq  # slow to import

    # affects only the size of the first stakes; measured to be harmless
    scale = float(values.max()) - lower
    if scale <= 0:
        return lower
    y = (values - lower) / scale
    log_gain_needed, tiny = math.log(1 / miss), 1e-300
    weights = weights or Weights(np.ones(len(y)))
    bets = y, _stakes(y, log_gain_needed, weights), log_gain_needed, weights
    if not _gain(tiny, *bets) > 0:
        return lower
    # a bet above the largest value loses; a closure would stay in memory
    m = brentq(_gain, tiny, 1.0, args=bets, xtol=1e-15, rtol=PRECISION)
    return lower + scale * float(m)


def log_gain(flagged: Truths, share: float, miss: float, weights: Weights) -> float:
    """Return the log gain of bets that flagged units exceed a share above 0.

    Above 0 they surely do. It errs with a probability of at most `miss`; the order is
    that of `mean_between`.
    """
    y, needed = flagged.astype(np.float64), math.log(1 / miss)
    return _gain(share, y, _stakes(y, needed, weights), needed, weights)


def _stakes(y: Array, needed: float, weights: Weights) -> Array:
    """Return the stake of each trial."""
    n, wy = len(y), weights.capped * y
    mean = np.cumsum(wy)
    mean += 0.5
    mean /= weights.so_far
    mean *= weights.capped
    wy -= mean
    wy *= wy
    # except for its scale, each stake depends only on the trials before it
    squares = np.append(0.0, np.cumsum(wy[:-1]))
    squares += 0.25
    squares /= np.arange(1, n + 1)
    return np.asarray(np.sqrt(2 * needed / n / squares))


def _gain(m: float, y: Array, stake: Array, needed: float, weights: Weights) -> float:
    """Return the logarithm of the final capital, less the wanted one."""
    capital = np.minimum(stake, MOST_STAKED / m / (weights.most + weights.cut))
    capital *= weights.capped * (y - m) - weights.cut * m
    return float(np.log1p(capital, out=capital).sum()) - needed
