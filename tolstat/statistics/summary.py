"""What a run says about each response."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.statistics.capability import Performance, by_moments, by_percentiles
from tolstat.statistics.estimate import NONE_DONE, RANDOM_ONLY, Estimate
from tolstat.statistics.limit import Limit
from tolstat.statistics.sample import Sample
from tolstat.statistics.statistic import (
    mean,
    quantiles_at,
    sigma,
    yields,
)
from tolstat.statistics.yields import Yield

Array = NDArray[np.float64]

QUANTILES = (0.00135, 0.05, 0.5, 0.95, 0.99, 0.99865)


class Limited(NamedTuple):
    """A response against its limit.

    Attributes
    ----------
    limit : Limit
        What is permitted, and of how many machines it is asked.
    yields : Yield
        Shares and verdict.
    percentiles, moments : Performance
        Pp and Ppk, either way.
    """

    limit: Limit
    yields: Yield
    percentiles: Performance
    moments: Performance


@dataclass(frozen=True)
class Summary:
    """One response over all trials that were run.

    Attributes
    ----------
    mean, sigma : Estimate
        Mean and standard deviation of the trials that are done.
    least, largest : float
        Of these; NaN if there are none.
    quantiles : dict of float to Estimate
        By `QUANTILES`.
    limited : Limited or None
        None without a limit.
    """

    mean: Estimate
    sigma: Estimate
    least: float
    largest: float
    quantiles: dict[float, Estimate]
    limited: Limited | None


def summarize(
    values: Array,
    sample: Sample,
    limit: Limit | None = None,
) -> Summary:
    """Summarize a response.

    Parameters
    ----------
    values : float64[trial]
        The response; NaN in trials that are not done.
    sample : Sample
        The trials.
    limit : Limit, optional
        What is permitted.

    Returns
    -------
    Summary
        Every number with its 95 % interval, or why it has none.
    """
    done = np.sort(values[sample.done])
    if len(done) == 0:
        quantiles = dict.fromkeys(QUANTILES, NONE_DONE)
        no_ratio = Performance(NONE_DONE, NONE_DONE)
        limited = None
        if limit is not None and sample.failed:  # each of them beyond it
            judged = yields(values, sample, limit.permitted, limit.demanded)
            limited = Limited(limit, judged, no_ratio, no_ratio)
        return Summary(NONE_DONE, NONE_DONE, math.nan, math.nan, quantiles, limited)
    limited = None
    if limit is not None:
        ends = limit.permitted
        found = yields(values, sample, ends, limit.demanded)
        performance = by_percentiles(done, ends), by_moments(done, ends)
        if sample.replicates:
            none = Estimate(math.nan, reason=RANDOM_ONLY)
            performance = Performance(none, none), Performance(none, none)
        limited = Limited(limit, found, *performance)
    return Summary(
        mean(values, sample),
        sigma(values, sample),
        float(done[0]),
        float(done[-1]),
        quantiles_at(values, sample, QUANTILES),
        limited,
    )
