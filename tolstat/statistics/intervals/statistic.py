"""Statistics of a response, each with the interval that its sampling allows."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array
from tolstat.statistics.estimate import NONE_DONE, Estimate
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


def mean(
    values: Array,
    sample: Sample,
    reach: Reach = ANYWHERE,
    confidence: float = 0.95,
) -> Estimate:
    """Estimate the mean of float64[trial] over the trials that are done."""
    done, replicate = values[sample.done], sample.replicate[sample.done]
    if sample.replicates:
        return mean_of_replicates(done, replicate, reach, confidence)
    return mean_of(done, reach, confidence, sample.weights_of(sample.done))


def sigma(
    values: Array,
    sample: Sample,
    reach: Reach = ANYWHERE,
    confidence: float = 0.95,
) -> Estimate:
    """Estimate the standard deviation over the trials that are done, as `mean` does."""
    done, replicate = values[sample.done], sample.replicate[sample.done]
    size = float(np.abs(done).max(initial=0.0))
    if size > 0 and not SQUARED[0] < size < SQUARED[1]:
        found = sigma(values / size, sample, reach.times(1 / size), confidence)
        value, lower, upper = (size * each for each in found[:3])
        return Estimate(value, lower, upper, found.reason)
    if sample.replicates:
        return sigma_of_replicates(done, replicate, reach, confidence)
    return sigma_of(done, reach, confidence, sample.weights_of(sample.done))


def quantiles_at(
    values: Array,
    sample: Sample,
    shares: Sequence[float],
    limit: tuple[float, float] | None = None,
    confidence: float = 0.95,
) -> dict[float, Estimate]:
    """Estimate quantiles by their shares.

    Parameters
    ----------
    limit : tuple of float, optional
        Permitted values. A failed trial is out of a limit with one end. Otherwise its
        value is unknown, and the interval holds for any value.
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
    """A statistic of a response.

    Attributes
    ----------
    response : str
        Name.
    kind : str
        "mean", "sigma", "quantile" or "beyond".
    share : float
        Share of a quantile.
    """

    response: str
    kind: str
    share: float = math.nan

    def of(
        self,
        values: Array,
        sample: Sample,
        limit: tuple[float, float] | None = None,
        declared: tuple[float, float] | None = None,
    ) -> Estimate:
        """Return its estimate; `declared` is the response range, infinite if open."""
        if self.kind == "quantile":
            return quantiles_at(values, sample, [self.share], limit)[self.share]
        if self.kind == "beyond":
            assert limit is not None  # checked with the study
            return yield_of(values, sample, limit).fraction_out_of_limit
        of = mean if self.kind == "mean" else sigma
        return of(values, sample, Reach(declared, limit))
