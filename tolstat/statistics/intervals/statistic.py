"""Statistics of a response, each with the interval that its sampling allows."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array
from tolstat.statistics.estimate import (
    CONFIDENCE,
    NONE_DONE,
    RANDOM_ONLY,
    Estimate,
)
from tolstat.statistics.intervals.as_sampled import mean_as_sampled, sigma_as_sampled
from tolstat.statistics.intervals.moments import ANYWHERE, Reach, mean_of, sigma_of
from tolstat.statistics.intervals.quantiles import median_unbiased, quantiles
from tolstat.statistics.intervals.replicates import (
    mean_of_replicates,
    quantile_of_replicates,
    sigma_of_replicates,
)
from tolstat.statistics.intervals.weighted_estimates import weighted_quantiles
from tolstat.statistics.limits.limit import worst_side
from tolstat.statistics.limits.yields import yield_of
from tolstat.statistics.sample import Sample

SQUARED = 1e-100, 1e100  # sizes between which squares are finite and not 0


class Moments(NamedTuple):
    """Mean and standard deviation of the trials that are done."""

    mean: Estimate
    sigma: Estimate

    def otherwise(self, other: Moments) -> Moments:
        """Return each that has an interval, and the other one where it has none."""
        pairs = zip(self, other, strict=True)
        return Moments(*(one if one.sure else another for one, another in pairs))


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
    return Moments(
        mean_as_sampled(done, confidence, replicate),
        sigma_as_sampled(done, confidence, replicate),
    )


def for_any(
    values: Array,
    sample: Sample,
    reach: Reach = ANYWHERE,
    confidence: float = 0.95,
) -> Moments:
    """Estimate mean and sigma for any distribution between two ends: see `Reach`."""
    done = values[sample.done]
    size = float(np.abs(done).max(initial=0.0))
    if size > 0 and not SQUARED[0] < size < SQUARED[1]:
        found = for_any(values / size, sample, reach.times(1 / size), confidence)
        return Moments(*(each.times(size) for each in found))
    if sample.replicates:
        given = done, sample.replicate[sample.done], reach, confidence
        return Moments(mean_of_replicates(*given), sigma_of_replicates(*given))
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

    def of(side: float) -> dict[float, Estimate]:
        """Estimate quantiles with failed trials on one side of all others."""
        placed = np.where(sample.done, values, side)[sample.ran]
        if weights:
            return weighted_quantiles(placed, weights, shares, confidence)
        return {
            share: quantile_of_replicates(placed, replicate, share, confidence)
            for share in shares
        }

    if worst or not sample.failed:
        return of(math.inf * (worst or 1))
    found, ordered, lows, highs = {}, np.sort(done), of(-math.inf), of(math.inf)
    weights_done = sample.weights_of(sample.done)
    known = weights_done and weighted_quantiles(done, weights_done, shares, confidence)
    for share in shares:
        low, high = lows[share], highs[share]
        value = known[share].value if known else median_unbiased(ordered, share)
        reason = low.reason or high.reason
        ends = (math.nan, math.nan) if reason else (low.lower, high.upper)
        found[share] = Estimate(value, *ends, reason)
    return found


class Statistic(NamedTuple):
    """A statistic of a response."""

    response: str
    kind: str  # "mean", "sigma", "quantile" or "beyond"
    share: float = math.nan  # share of a quantile

    def of(
        self,
        values: Array,
        sample: Sample,
        limit: tuple[float, float] | None = None,
        declared: tuple[float, float] | None = None,
        confidence: float = CONFIDENCE,
    ) -> Estimate:
        """Return its estimate; `declared` is the response range, infinite if open.

        Another confidence is for quantiles only.
        """
        if self.kind == "quantile":
            shares = [self.share]
            return quantiles_at(values, sample, shares, limit, confidence)[self.share]
        if self.kind == "beyond":
            assert limit is not None  # checked with the study
            return yield_of(values, sample, limit).fraction_out_of_limit
        wide = for_any(values, sample, Reach(declared, limit))
        found = as_sampled(values, sample).otherwise(wide)
        return found.mean if self.kind == "mean" else found.sigma
