"""The statistics of a response."""

import math
from dataclasses import dataclass
from typing import NamedTuple

from tolstat.arrays import Array
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.intervals.moments import Ends, Reach
from tolstat.statistics.limits.audited_response import AuditedResponse
from tolstat.statistics.limits.capability import (
    Performance,
    by_moments,
    by_percentiles,
    by_share,
)
from tolstat.statistics.limits.limit import Limit
from tolstat.statistics.limits.yields import Yield, yield_of
from tolstat.statistics.sample import Sample, as_sampled, for_any, quantiles_at

QUANTILES = (0.00135, 0.05, 0.5, 0.95, 0.99, 0.99865)


class Limited(NamedTuple):
    """A response against its limit."""

    limit: Limit  # permitted values and demanded yield
    yields: Yield  # shares and verdict
    demanded_ppk: float  # the demanded yield as the Ppk of a normal response
    equivalent_ppk: Estimate  # Ppk of a normal response with as many units out of limit
    # Pp and Ppk by either method
    percentiles: Performance
    moments: Performance


@dataclass(frozen=True)
class Summary:
    """One response over all trials that have run."""

    # mean and standard deviation of the trials that are done, as sampled: if no rarer
    # kind of trial exists than those seen. As the next two if few trials dominate.
    mean: Estimate
    sigma: Estimate
    # the same for any distribution between the ends of `Reach`
    mean_for_any_distribution: Estimate
    sigma_for_any_distribution: Estimate
    # extremes of the trials that are done; NaN without any, or with weights
    least: float
    largest: float
    quantiles: dict[float, Estimate]  # quantile by share, for `QUANTILES`
    limited: Limited | None  # None without a limit

    @property
    def weighted(self) -> bool:
        """Whether trials are weighted: without extremes, or a number that decides."""
        return math.isnan(self.least) and math.isfinite(self.quantiles[0.5].value)


def summarize(
    values: Array,
    sample: Sample,
    limit: Limit | None = None,
    declared: Ends | None = None,
    ends: Array | None = None,
    audited: AuditedResponse | None = None,
) -> Summary:
    """Summarize a response: float64[trial], SI, NaN in trials that are not done.

    `declared` is the declared range of the response; an open end is infinite. `ends`
    and `audited` are those of `yield_of`.
    """
    done = values[sample.done]
    limited = None
    if limit is not None and (sample.weights or sample.ran.any()):
        judged = yield_of(
            values, sample, limit.permitted, limit.demanded, ends, audited
        )
        limited = Limited(
            limit,
            judged,
            limit.ppk,
            by_share(judged.fraction_out_of_limit, limit),
            by_percentiles(values, sample, limit),
            by_moments(values, sample, limit, declared),
        )
    if sample.weights:  # the outermost trial is not the outermost unit
        done = done[:0]
    permitted = limit.permitted if limit else None
    reach = Reach(declared, permitted)
    wide = for_any(values, sample, reach)
    return Summary(
        *as_sampled(values, sample).otherwise(wide),
        *wide,
        float(done.min()) if len(done) else math.nan,
        float(done.max()) if len(done) else math.nan,
        quantiles_at(values, sample, QUANTILES, permitted),
        limited,
    )
