"""Statistics of a response by name, each with the interval that its sampling allows."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.statistics.estimate import NONE_DONE, Estimate
from tolstat.statistics.limit import worst_side
from tolstat.statistics.moments import Range, mean_of, sigma_of
from tolstat.statistics.quantiles import median_unbiased, quantiles
from tolstat.statistics.replicates import (
    mean_of_replicates,
    quantile_of_replicates,
    sigma_of_replicates,
)
from tolstat.statistics.sample import Sample
from tolstat.statistics.yields import yield_of

Array = NDArray[np.float64]


def mean(
    values: Array,
    sample: Sample,
    ends: Range | None = None,
    confidence: float = 0.95,
) -> Estimate:
    """Estimate the mean over the trials that are done.

    Parameters
    ----------
    values : float64[trial]
        The response; NaN in trials that are not done.
    sample : Sample
        The trials.
    ends : tuple of float, optional
        Declared range of the response; an open end is infinite.
    confidence : float
        Of the interval.
    """
    done, replicate = values[sample.done], sample.replicate[sample.done]
    if sample.replicates:
        return mean_of_replicates(done, replicate, ends, confidence)
    return mean_of(done, ends, confidence)


def sigma(
    values: Array,
    sample: Sample,
    ends: Range | None = None,
    confidence: float = 0.95,
) -> Estimate:
    """Estimate the standard deviation over the trials that are done, as `mean` does."""
    done, replicate = values[sample.done], sample.replicate[sample.done]
    if sample.replicates:
        return sigma_of_replicates(done, replicate, ends, confidence)
    return sigma_of(done, ends, confidence)


def quantiles_at(
    values: Array,
    sample: Sample,
    shares: Iterable[float],
    limit: tuple[float, float] | None = None,
    confidence: float = 0.95,
) -> dict[float, Estimate]:
    """Estimate the values that shares of the machines stay below.

    Parameters
    ----------
    values : float64[trial]
        The response; NaN in trials that are not done.
    sample : Sample
        The trials.
    shares : iterable of float
        Between 0 and 1.
    limit : tuple of float, optional
        Permitted values. A failed trial stands beyond the end of a limit that has one;
        else nobody knows where, and the interval holds wherever it is.
    confidence : float
        Of the intervals.
    """
    done = values[sample.done]
    if not len(done):
        return dict.fromkeys(shares, NONE_DONE)
    worst = worst_side(limit)
    if not sample.replicates:
        return quantiles(done, shares, confidence, sample.failed, worst)
    replicate = sample.replicate[sample.ran]

    def of(share: float, side: float) -> Estimate:
        """Estimate it with failed trials on one side of all others."""
        placed = np.where(sample.done, values, side)[sample.ran]
        return quantile_of_replicates(placed, replicate, share, confidence)

    if worst or not sample.failed:
        return {share: of(share, math.inf * (worst or 1)) for share in shares}
    found, ordered = {}, np.sort(done)
    for share in shares:
        low, high = of(share, -math.inf), of(share, math.inf)
        value, reason = median_unbiased(ordered, share), low.reason or high.reason
        found[share] = Estimate(value, low.lower, high.upper, reason)
        if reason:
            found[share] = Estimate(value, reason=reason)
    return found


class Statistic(NamedTuple):
    """Which number of which response.

    Attributes
    ----------
    response : str
        Name.
    kind : str
        "mean", "sigma", "quantile" or "beyond".
    share : float
        Of a quantile.
    """

    response: str
    kind: str
    share: float = math.nan

    def of(
        self,
        values: Array,
        sample: Sample,
        limit: tuple[float, float] | None = None,
        ends: Range | None = None,
    ) -> Estimate:
        """Estimate it.

        Parameters
        ----------
        values : float64[trial]
            The response; NaN in trials that are not done.
        sample : Sample
            The trials.
        limit : tuple of float, optional
            Least and greatest permitted value, for "beyond".
        ends : tuple of float, optional
            Declared range of the response.
        """
        if self.kind == "quantile":
            return quantiles_at(values, sample, [self.share], limit)[self.share]
        if self.kind == "beyond":
            assert limit is not None  # checked with the study
            return yield_of(values, sample, limit).beyond
        return (mean if self.kind == "mean" else sigma)(values, sample, ends)
