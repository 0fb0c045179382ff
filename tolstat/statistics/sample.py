"""The trials of a run, and statistics of its responses as their sampling allows."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.arrays import Array, Integers, Truths
from tolstat.statistics.estimate import (
    NONE_DONE,
    RANDOM_ONLY,
    Estimate,
    Lack,
    NoInterval,
)
from tolstat.statistics.intervals.as_sampled import mean_as_sampled, sigma_as_sampled
from tolstat.statistics.intervals.moments import ANYWHERE, Reach, mean_of, sigma_of
from tolstat.statistics.intervals.quantiles import (
    median_unbiased,
    quantiles,
    worst_side,
)
from tolstat.statistics.intervals.replicates import (
    mean_of_replicates,
    quantile_of_replicates,
    share_from_replicates,
    sigma_of_replicates,
)
from tolstat.statistics.intervals.shares import anytime_valid, proportion
from tolstat.statistics.intervals.weighted_estimates import (
    weighted_quantiles,
    weighted_share,
)
from tolstat.statistics.intervals.weights import RARE, Thinned, Weights
from tolstat.status import Status

SQUARED = 1e-100, 1e100  # sizes between which squares are finite and not 0


class Sample(NamedTuple):
    """The trials of a run, for all its responses."""

    status: NDArray[np.integer]  # int[trial]: values of `Status`
    replicates: int = 0  # replicates of the sampling; 0 if the trials are independent
    # trials of the run for each trial of the sample: above 1 in a run for Sobol'
    # indices
    each: float = 1.0
    # given if trials stand for units of other distributions; all trials have run
    weights: Weights | None = None
    # given if trials were thinned: only shares are known of these
    thinned: Thinned | None = None

    @property
    def done(self) -> Truths:
        """Which trials are done."""
        done: Truths = self.status == Status.DONE
        return done

    @property
    def ran(self) -> Truths:
        """Which trials have run, failed ones included."""
        ran: Truths = self.status != Status.NOT_RUN
        return ran

    @property
    def failed_trials(self) -> Truths:
        """Which trials ran and failed."""
        return self.ran & ~self.done

    @property
    def failed(self) -> int:
        """Number of the trials that ran and failed."""
        return int(np.count_nonzero(self.failed_trials))

    @property
    def replicate(self) -> Integers:
        """Randomisation number of each trial: int64[trial]."""
        return np.arange(len(self.status)) % max(self.replicates, 1)

    def share(
        self,
        units: Truths,
        among: Truths,
        counted: Callable[[int, int], Estimate] = anytime_valid,
    ) -> Estimate:
        """Estimate the share of units with a property among some of the trials.

        `counted` estimates a share from a count and a number of independent trials.
        """
        units = units[among]
        if self.replicates:
            return share_from_replicates(units, self.replicate[among])
        if self.weights:
            return weighted_share(units, self.weights.selected(among))
        if self.thinned:  # all of its trials have run
            from tolstat.statistics.deciding.thinned_share import (  # seldom
                thinned_share,
            )

            return thinned_share(units, self.thinned)
        return counted(int(np.count_nonzero(units)), len(units))

    def weights_of(self, trials: Truths) -> Weights | None:
        """Return the weights of the trials that bool[trial] selects."""
        return self.weights and self.weights.selected(trials)

    def first(self, trials: int) -> Sample:
        """Return the first trials."""
        return self._replace(status=self.status[:trials])

    def telling(self, permitted: float) -> Sample:
        """Return the trials that tell of a limit with this permitted share.

        Trials without a chance count as within a limit that permits few.
        """
        if self.thinned is None or permitted < RARE:
            return self
        number = self.thinned.covering
        return self.first(number)._replace(thinned=self.thinned.first(number))

    @property
    def failures(self) -> Estimate:
        """Share of the trials that ran and failed."""
        if not self.ran.any():
            return Estimate(math.nan, reason=NoInterval(Lack.ANY_RUN))
        return self.share(~self.done, self.ran, proportion)


class Moments(NamedTuple):
    """Mean and standard deviation of the trials that are done."""

    mean: Estimate
    sigma: Estimate

    def otherwise(self, other: Moments) -> Moments:
        """Return each that has an interval, and the other one where it has none."""
        pairs = zip(self, other, strict=True)
        return Moments(*(first if first.sure else second for first, second in pairs))


def as_sampled(values: Array, sample: Sample, confidence: float = 0.95) -> Moments:
    """Estimate mean and sigma of float64[trial]: see `mean_as_sampled`.

    They hold if no rarer kind of trial exists than those seen; none for weighted
    trials.
    """
    done = values[sample.done]
    if sample.weights:
        none = Estimate(math.nan, reason=RANDOM_ONLY)
        return Moments(none, none)
    replicate = sample.replicate[sample.done] if sample.replicates else None
    arguments = done, confidence, replicate
    return Moments(mean_as_sampled(*arguments), sigma_as_sampled(*arguments))


def for_any(
    values: Array, sample: Sample, reach: Reach = ANYWHERE, confidence: float = 0.95
) -> Moments:
    """Estimate mean and sigma for any distribution between two ends: see `Reach`."""
    done = values[sample.done]
    size = float(np.abs(done).max(initial=0.0))
    if size > 0 and not SQUARED[0] < size < SQUARED[1]:
        scaled = for_any(values / size, sample, reach.times(1 / size), confidence)
        return Moments(*(moment.times(size) for moment in scaled))
    if sample.replicates:
        arguments = done, sample.replicate[sample.done], reach, confidence
        return Moments(mean_of_replicates(*arguments), sigma_of_replicates(*arguments))
    independent = done, reach, confidence, sample.weights_of(sample.done)
    return Moments(mean_of(*independent), sigma_of(*independent))


def quantiles_at(
    values: Array,
    sample: Sample,
    shares: Sequence[float],
    limit: tuple[float, float] | None = None,
    confidence: float = 0.95,
) -> dict[float, Estimate]:
    """Estimate quantiles by their shares.

    `limit` are the permitted values. A failed trial is out of a limit with one end.
    Otherwise its value is unknown, and the interval holds for any value.
    """
    done = values[sample.done]
    if not len(done):
        return dict.fromkeys(shares, NONE_DONE)
    worst = worst_side(limit)
    if not sample.replicates and not sample.weights:
        return quantiles(done, shares, confidence, sample.failed, worst)
    replicate, weights = sample.replicate[sample.ran], sample.weights_of(sample.ran)

    def with_failed_at(side: float) -> dict[float, Estimate]:
        """Estimate quantiles with failed trials on one side of all others."""
        placed = np.where(sample.done, values, side)[sample.ran]
        if weights:
            return weighted_quantiles(placed, weights, shares, confidence)
        return {
            share: quantile_of_replicates(placed, replicate, share, confidence)
            for share in shares
        }

    if worst or not sample.failed:
        return with_failed_at(math.inf * (worst or 1))
    estimates, ordered = {}, np.sort(done)
    lows, highs = with_failed_at(-math.inf), with_failed_at(math.inf)
    mixed = sample.weights_of(sample.done)
    of_done = mixed and weighted_quantiles(done, mixed, shares, confidence)
    for share in shares:
        low, high = lows[share], highs[share]
        value = of_done[share].value if of_done else median_unbiased(ordered, share)
        reason = low.reason or high.reason
        ends = (math.nan, math.nan) if reason else (low.lower, high.upper)
        estimates[share] = Estimate(value, *ends, reason)
    return estimates
