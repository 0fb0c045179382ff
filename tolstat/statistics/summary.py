"""What a run says about each response."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.statistics.capability import Performance, by_moments, by_percentiles
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.moments import deviation_of, mean_of
from tolstat.statistics.proportions import proportion
from tolstat.statistics.quantiles import quantile
from tolstat.statistics.replicates import from_replicates
from tolstat.statistics.yields import DEMANDED, Yield, yield_of, yield_of_replicates
from tolstat.status import Status

Array = NDArray[np.float64]

SHARES = (0.00135, 0.05, 0.5, 0.95, 0.99, 0.99865)


class Sample(NamedTuple):
    """The trials of a run, for all its responses.

    Attributes
    ----------
    status : int[trial]
        Values of `Status`.
    replicates : int
        Of the sampling: 0 where the trials are independent.
    """

    status: NDArray[np.integer]
    replicates: int = 0

    @property
    def done(self) -> NDArray[np.bool_]:
        """Which trials are done."""
        found: NDArray[np.bool_] = self.status == Status.DONE
        return found

    @property
    def ran(self) -> NDArray[np.bool_]:
        """Which trials have run, failed ones among them."""
        found: NDArray[np.bool_] = self.status != Status.NOT_RUN
        return found

    @property
    def replicate(self) -> NDArray[np.int64]:
        """Number of the randomisation that each trial belongs to."""
        return np.arange(len(self.status)) % max(self.replicates, 1)

    @property
    def failures(self) -> Estimate:
        """Share of the trials that ran and failed."""
        trials = int(np.count_nonzero(self.ran))
        if trials == 0:
            return Estimate(math.nan, reason="no trial has run")
        failed = trials - int(np.count_nonzero(self.done))
        if self.replicates:
            values = (~self.done[self.ran]).astype(float)
            return from_replicates(np.mean, values, self.replicate[self.ran])
        return Estimate(*proportion(failed, trials))


class Limited(NamedTuple):
    """A response against its limit.

    Attributes
    ----------
    limit : tuple of float
        Least and greatest permitted value.
    demanded : float
        Yield that is asked for.
    yields : Yield
        Shares and verdict.
    percentiles, moments : Performance
        Pp and Ppk, either way.
    """

    limit: tuple[float, float]
    demanded: float
    yields: Yield
    percentiles: Performance
    moments: Performance


class Summary(NamedTuple):
    """One response over all trials that were run.

    Attributes
    ----------
    mean, deviation : Estimate
        Mean and standard deviation of the trials that are done.
    least, largest : float
        Of these; NaN if there are none.
    quantiles : dict of float to Estimate
        By `SHARES`.
    limited : Limited or None
        None without a limit.
    """

    mean: Estimate
    deviation: Estimate
    least: float
    largest: float
    quantiles: dict[float, Estimate]
    limited: Limited | None


def summarize(
    values: Array,
    sample: Sample,
    limit: tuple[float, float] | None = None,
    demanded: float = DEMANDED,
) -> Summary:
    """Summarize a response.

    Parameters
    ----------
    values : float64[trial]
        The response; NaN in trials that are not done.
    sample : Sample
        The trials.
    limit : tuple of float, optional
        Least and greatest permitted value.
    demanded : float
        Yield that is asked for.

    Returns
    -------
    Summary
        Every number with its 95 % interval, or why it has none.
    """
    done = values[sample.done]
    if len(done) == 0:
        none = Estimate(math.nan, reason="no trial is done")
        return Summary(
            none, none, math.nan, math.nan, dict.fromkeys(SHARES, none), None
        )
    extremes = float(done.min()), float(done.max())
    if sample.replicates:
        return _of_replicates(done, extremes, sample, values, limit, demanded)
    ordered = np.sort(done)
    limited = None
    if limit is not None:
        failed = int(np.count_nonzero(sample.ran)) - len(done)
        limited = Limited(
            limit,
            demanded,
            yield_of(done, failed, limit, demanded),
            by_percentiles(ordered, limit),
            by_moments(done, limit),
        )
    quantiles = {}
    for share in SHARES:
        found = quantile(ordered, share)
        sure = not (math.isnan(found.lower) or math.isnan(found.upper))
        quantiles[share] = Estimate(
            found.estimate,
            found.lower,
            found.upper,
            "" if sure else f"needs {found.needed}",
        )
    return Summary(mean_of(done), deviation_of(done), *extremes, quantiles, limited)


def _of_replicates(
    done: Array,
    extremes: tuple[float, float],
    sample: Sample,
    values: Array,
    limit: tuple[float, float] | None,
    demanded: float,
) -> Summary:
    """Summarize trials that depend on each other."""
    replicate = sample.replicate[sample.done]

    def at(share: float) -> Estimate:
        def one(x: Array) -> float:
            return float(np.quantile(x, share, method="median_unbiased"))

        found = from_replicates(one, done, replicate)
        smallest = int(np.bincount(replicate).min())
        # a replicate that never reaches so far says nothing of it
        if smallest * min(share, 1 - share) < 1:
            needed = math.ceil(1 / min(share, 1 - share)) * sample.replicates
            return Estimate(found.value, reason=f"needs {needed}")
        return found

    def deviation(x: Array) -> float:
        return float(np.std(x, ddof=1))

    limited = None
    if limit is not None:
        ran = sample.ran
        yields = yield_of_replicates(
            values[ran], sample.done[ran], sample.replicate[ran], limit, demanded
        )
        none = Estimate(math.nan, reason="for random trials only")
        nothing = Performance(none, none)
        limited = Limited(limit, demanded, yields, nothing, nothing)
    return Summary(
        from_replicates(np.mean, done, replicate),
        from_replicates(deviation, done, replicate),
        *extremes,
        {share: at(share) for share in SHARES},
        limited,
    )
