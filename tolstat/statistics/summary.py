"""The statistics of a response, and its performance against a limit: Pp and Ppk.

Simulated units do not prove a stable process: by ISO 22514-1 the indices are those of
performance (Pp, Ppk), not of capability (Cp, Cpk).
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array
from tolstat.statistics.estimate import (
    CONFIDENCE,
    NONE_DONE,
    Estimate,
    Lack,
    NoInterval,
)
from tolstat.statistics.intervals.moments import Ends, Reach
from tolstat.statistics.limits.limit import Limit, ppk_of
from tolstat.statistics.limits.yields import PartsUncertainty, Yield, yield_of
from tolstat.statistics.sample import Sample, as_sampled, for_any, quantiles_at

LOW, MIDDLE, HIGH = 0.00135, 0.5, 0.99865
LEAST_OF_MOMENTS = 200  # trials from which Ppk by moments has an interval
MOST_PPK = 100.0  # Ppk above which the spread is too small to be a measure
ONE_END = Estimate(math.nan, reason=NoInterval(Lack.SECOND_END))
NO_SPREAD = Estimate(math.nan, reason=NoInterval(Lack.SPREAD))


class Performance(NamedTuple):
    """Pp (NaN for a limit with one end) and Ppk."""

    pp: Estimate
    ppk: Estimate


def by_percentiles(values: Array, sample: Sample, limit: Limit) -> Performance:
    """Estimate Pp and Ppk from percentiles: for responses of any distribution.

    Pp = (U - L)/(X99.865 - X0.135), Ppk the lesser of (U - X50)/(X99.865 - X50) and
    (X50 - L)/(X50 - X0.135). The intervals follow from those of the percentiles, each
    with its share of the error: conservative. Independent trials need 3544.

    References
    ----------
    ISO 22514-2:2017, method M4 (percentiles).
    """
    if not sample.done.any():
        return Performance(NONE_DONE, NONE_DONE)
    if np.ptp(values[sample.done]) == 0:  # more trials would not change it
        return Performance(NO_SPREAD, NO_SPREAD)
    # up to three percentiles determine one number: share the error among them
    shared = 1 - (1 - CONFIDENCE) / 3
    shares = (LOW, MIDDLE, HIGH)
    percentiles = quantiles_at(values, sample, shares, limit.permitted, shared)
    low, middle, high = percentiles.values()
    sides = [
        _side(end, middle, outer, sign)
        for end, outer, sign in ((limit.upper, high, 1), (limit.lower, low, -1))
        if math.isfinite(end)
    ]
    spread = Estimate(
        high.value - low.value, high.lower - low.upper, high.upper - low.lower
    )
    reason = next((side.reason for side in sides if side.reason), "")
    return _performance(limit, sides, 1, spread, reason)


def by_moments(
    values: Array, sample: Sample, limit: Limit, declared: Ends | None = None
) -> Performance:
    """Estimate Pp and Ppk from mean and sigma, as for normal responses.

    Pp = (U - L)/6s, Ppk the lesser of (U - mean)/3s and (mean - L)/3s. The intervals
    follow from those of mean and sigma as sampled, each with half the error: none if
    few trials dominate, or below 200 trials. Those of weighted trials and replicates
    are for any distribution. They describe the share out of limit for normal responses
    only.
    """
    if not sample.done.any():
        return Performance(NONE_DONE, NONE_DONE)
    half = 1 - (1 - CONFIDENCE) / 2
    reach = Reach(declared, limit.permitted)
    if dependent := bool(sample.weights or sample.replicates):
        middle, spread = for_any(values, sample, reach, half)
    else:
        middle, spread = as_sampled(values, sample, half)
    if not spread.value > 0:
        return Performance(NO_SPREAD, NO_SPREAD)
    reason = middle.reason or spread.reason
    if not dependent and sample.done.sum() < LEAST_OF_MOMENTS:
        reason = NoInterval(Lack.TRIALS, needed=LEAST_OF_MOMENTS)
    if spread.sure and spread.lower <= 0:
        reason = NoInterval(Lack.LEAST_SIGMA)
    sides = []
    for end in reversed(limit.finite):
        sign = 1 if end == limit.upper else -1
        ratios = [
            _ratio(sign * (end - m), 3 * s) for m in middle[:3] for s in spread[:3]
        ]
        sides.append(Estimate(ratios[0], min(ratios), max(ratios)))
    return _performance(limit, sides, 6, spread, reason)


def by_share(share: Estimate, limit: Limit) -> Estimate:
    """Estimate the Ppk of a normal response with a share of the units out of limit.

    With two ends the response is centred: half of these units are outside each end.
    """
    ppk, upper, lower = (ppk_of(number, limit.ends) for number in share[:3])
    if not share.sure:
        return Estimate(ppk, reason=share.reason)
    return Estimate(ppk, lower, upper)


def _performance(
    limit: Limit, sides: list[Estimate], widths: int, spread: Estimate, reason: str
) -> Performance:
    """Return Ppk from its sides, and Pp as the limit over `widths` times the spread."""
    values = [side.value for side in sides]
    ppk = Estimate(
        math.nan if np.isnan(values).any() else min(values),
        min(side.lower for side in sides),
        min(side.upper for side in sides),
        reason,
    )
    pp = ONE_END
    if limit.ends == 2:
        width = (limit.upper - limit.lower) / widths
        value, most, least = (_ratio(width, number) for number in spread[:3])
        pp = Estimate(value, least, most, reason)
    return Performance(_worth_printing(pp), _worth_printing(ppk))


def _side(end: float, middle: Estimate, outer: Estimate, sign: int) -> Estimate:
    """Estimate one side of Ppk: the end's distance over the far percentile's."""

    def ratio(m: float, f: float) -> float:
        return _ratio(sign * (end - m), sign * (f - m))

    value = ratio(middle.value, outer.value)
    if not (middle.sure and outer.sure):
        return Estimate(value, reason=outer.reason or middle.reason)
    if middle.lower == outer.lower or middle.upper == outer.upper:
        return Estimate(math.nan, reason=NoInterval(Lack.UNEQUAL_HALVES))
    if outer.lower == outer.upper:
        return Estimate(math.nan, reason=NoInterval(Lack.UNEQUAL_OUTERMOST))
    # monotonic in either percentile: the extremes lie at the corners
    corners = [
        ratio(m, f)
        for m in (middle.lower, middle.upper)
        for f in (outer.lower, outer.upper)
    ]
    return Estimate(value, min(corners), max(corners))


def _ratio(distance: float, spread: float) -> float:
    """Return distance over spread; without spread, infinity of the sign of distance."""
    if spread == 0 and distance != 0:
        return math.inf if distance > 0 else -math.inf
    return distance / spread if spread != 0 else math.nan


def _worth_printing(index: Estimate) -> Estimate:
    """Return the estimate, or the reason why its interval or number is not printed."""
    if index.value > MOST_PPK or (index.sure and index.lower > MOST_PPK):
        return Estimate(math.nan, reason=NoInterval(Lack.MORE_SPREAD, most=MOST_PPK))
    if index.reason or not index.sure:
        return Estimate(index.value, reason=index.reason)
    return index


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
    def normal_tails(self) -> bool | None:
        """Whether the outermost 0.135 % lie as in a normal response, at each limit.

        None where too few trials show it. Counts are for any distribution: where they
        exclude the Ppk by moments, the tails are not those of a normal response.
        """
        if self.limited is None or not (self.mean.sure and self.sigma.sure):
            return None
        if self.limited.equivalent_ppk.upper < self.limited.moments.ppk.lower:
            return False
        lower, upper = self.limited.limit.permitted
        sides = {LOW: (lower, -3.0), HIGH: (upper, 3.0)}
        shown = list[bool]()
        for share, (end, scores) in sides.items():
            tail = self.quantiles[share]
            if not math.isfinite(end):
                continue
            if not tail.sure:
                return None
            far = self.mean.value + scores * self.sigma.value
            shown.append(tail.lower <= far <= tail.upper)
        return all(shown)

    @property
    def weighted(self) -> bool:
        """Whether trials are weighted: without extremes, or a number that decides."""
        return math.isnan(self.least) and math.isfinite(self.quantiles[0.5].value)


ENDS = (0.025, 0.975)  # of draws


class MovedNumbers(NamedTuple):
    """What the numbers of a response gain, by draw: float64[draw]."""

    mean: Array
    sigma: Array
    quantiles: Mapping[float, Array]

    def widened(
        self, estimate: Estimate, gains: Array, least: float = -math.inf
    ) -> Estimate:
        """Return an estimate with both errors, combined by squares, above a least."""
        if not estimate.sure or not np.isfinite(gains).all():
            return estimate
        (value, lower, upper, _), (down, up) = estimate, np.quantile(gains, ENDS)
        return Estimate(
            value,
            max(value - math.hypot(value - lower, min(down, 0.0)), least),
            value + math.hypot(upper - value, max(up, 0.0)),
        )


class ResponseUncertainty(NamedTuple):
    """How uncertain a response is by the measured parts."""

    share: PartsUncertainty | None  # None without a limit
    numbers: MovedNumbers | None  # None where the parts are too few


def summarize(
    values: Array,
    sample: Sample,
    limit: Limit | None = None,
    declared: Ends | None = None,
    uncertainty: ResponseUncertainty | None = None,
    judged: Yield | None = None,
) -> Summary:
    """Summarize a response: float64[trial], SI, NaN in trials that are not done.

    `declared` is the declared range of the response; an open end is infinite.
    `uncertainty` widens all intervals. `judged` is the yield if it rests on other
    trials than these, or an audit was made.
    """
    done = values[sample.done]
    limited = None
    if limit is not None and (sample.weights or sample.ran.any()):
        judged = judged or yield_of(
            values, sample, limit.permitted, limit.demanded,
            measured=uncertainty.share if uncertainty else None,
        )  # fmt: skip
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
    summary = Summary(
        *as_sampled(values, sample).otherwise(wide),
        *wide,
        float(done.min()) if len(done) else math.nan,
        float(done.max()) if len(done) else math.nan,
        quantiles_at(values, sample, QUANTILES, permitted),
        limited,
    )
    if uncertainty and uncertainty.numbers:
        return _widened(summary, uncertainty.numbers)
    return summary


def _widened(summary: Summary, moved: MovedNumbers) -> Summary:
    """Return a summary whose intervals hold the uncertainty of measured parts, too."""
    limited, sigma = summary.limited, moved.sigma
    low, middle, high = (
        summary.quantiles[share].value + moved.quantiles[share]
        for share in (LOW, MIDDLE, HIGH)
    )
    if limited:
        mean = summary.mean.value + moved.mean
        reach = 3 * (summary.sigma.value + sigma)
        limited = limited._replace(
            percentiles=_widened_performance(
                limited.percentiles, moved, _indices(limited.limit, low, middle, high)
            ),
            moments=_widened_performance(
                limited.moments, moved,
                _indices(limited.limit, mean - reach, mean, mean + reach),
            ),
        )  # fmt: skip
    for_any = summary.mean_for_any_distribution, summary.sigma_for_any_distribution
    return replace(
        summary,
        mean=moved.widened(summary.mean, moved.mean),
        sigma=moved.widened(summary.sigma, sigma, 0.0),
        mean_for_any_distribution=moved.widened(for_any[0], moved.mean),
        sigma_for_any_distribution=moved.widened(for_any[1], sigma, 0.0),
        quantiles={
            share: moved.widened(number, moved.quantiles[share])
            for share, number in summary.quantiles.items()
        },
        limited=limited,
    )


def _indices(
    limit: Limit, low: Array, middle: Array, high: Array
) -> tuple[Array, Array]:
    """Return Pp and Ppk from the ends and the middle of 99.73 %."""
    with np.errstate(divide="ignore"):  # equal values are infinitely capable
        pp = (limit.upper - limit.lower) / (high - low)
        sides = (
            (limit.upper - middle) / (high - middle),
            (middle - limit.lower) / (middle - low),
        )
    return pp, np.minimum(*sides)


def _widened_performance(
    performance: Performance, moved: MovedNumbers, draws: tuple[Array, Array]
) -> Performance:
    return Performance(*(
        moved.widened(index, index_draws - index.value)
        for index, index_draws in zip(performance, draws, strict=True)
    ))  # fmt: skip
