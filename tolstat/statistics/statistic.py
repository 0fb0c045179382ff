"""Statistics of a response by name, each with the interval that its sampling allows."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.statistics.estimate import NONE_DONE, Estimate, untrustworthy
from tolstat.statistics.limit import DEMANDED
from tolstat.statistics.moments import (
    mean_of,
    moments,
    moments_are_trustworthy,
    sigma_of,
)
from tolstat.statistics.quantiles import quantiles
from tolstat.statistics.replicates import from_replicates
from tolstat.statistics.sample import Sample
from tolstat.statistics.yields import Yield, yield_of, yield_of_replicates

Array = NDArray[np.float64]


def mean(values: Array, sample: Sample) -> Estimate:
    """Estimate the mean of float64[trial] over the trials that are done."""
    done = values[sample.done]
    if sample.replicates:
        return from_replicates(np.mean, done, sample.replicate[sample.done])
    return mean_of(done) if len(done) else NONE_DONE


def sigma(values: Array, sample: Sample) -> Estimate:
    """Estimate the standard deviation over the trials that are done."""
    done = values[sample.done]
    if sample.replicates:

        def of(x: Array) -> float:
            return float(np.std(x, ddof=1))

        if not moments_are_trustworthy(moments(done)):
            return untrustworthy(of(done) if len(done) > 1 else math.nan, len(done))
        return from_replicates(of, done, sample.replicate[sample.done])
    return sigma_of(done) if len(done) else NONE_DONE


def quantile_at(values: Array, sample: Sample, share: float) -> Estimate:
    """Estimate the value that a share of the machines that are done stays below.

    Parameters
    ----------
    values : float64[trial]
        The response; NaN in trials that are not done.
    sample : Sample
        The trials.
    share : float
        Between 0 and 1.
    """
    return quantiles_at(values, sample, [share])[share]


def quantiles_at(
    values: Array, sample: Sample, shares: Iterable[float]
) -> dict[float, Estimate]:
    """Estimate quantiles by their shares, as `quantile_at` does."""
    done = values[sample.done]
    if not len(done):
        return dict.fromkeys(shares, NONE_DONE)
    if sample.replicates:
        return {s: _quantile_of_replicates(done, sample, s) for s in shares}
    return quantiles(done, shares)


def _quantile_of_replicates(done: Array, sample: Sample, share: float) -> Estimate:
    replicate = sample.replicate[sample.done]

    def of(x: Array) -> float:
        return float(np.quantile(x, share, method="median_unbiased"))

    found = from_replicates(of, done, replicate)
    smallest = int(np.bincount(replicate).min())
    # a replicate that never reaches so far says nothing of it
    if smallest * min(share, 1 - share) < 1:
        needed = math.ceil(1 / min(share, 1 - share)) * sample.replicates
        return Estimate(found.value, reason=f"needs {needed}")
    return found


def yields(
    values: Array,
    sample: Sample,
    limit: tuple[float, float],
    demanded: float = DEMANDED,
) -> Yield:
    """Estimate shares within and beyond a limit, failed trials counted against.

    Parameters
    ----------
    values : float64[trial]
        The response; NaN in trials that are not done.
    sample : Sample
        The trials.
    limit : tuple of float
        Least and greatest permitted value.
    demanded : float
        Share of machines that is to be within.
    """
    if sample.replicates:
        ran = sample.ran
        return yield_of_replicates(
            values[ran], sample.done[ran], sample.replicate[ran], limit, demanded
        )
    return yield_of(values[sample.done], sample.failed, limit, demanded)


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
        self, values: Array, sample: Sample, limit: tuple[float, float] | None = None
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
        """
        if self.kind == "quantile":
            return quantile_at(values, sample, self.share)
        if self.kind == "beyond":
            assert limit is not None  # checked with the study
            return yields(values, sample, limit).beyond
        return (mean if self.kind == "mean" else sigma)(values, sample)
