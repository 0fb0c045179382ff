"""A requested precision, and the number of trials that reaches it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array
from tolstat.statistics.estimate import CONFIDENCE, Estimate
from tolstat.statistics.intervals.moments import Ends, Reach
from tolstat.statistics.limits.yields import yield_of
from tolstat.statistics.sample import Sample, as_sampled, for_any, quantiles_at

FIRST_STAGE = 1024  # trials of the first stage
RESERVE = 1.1  # times the trials that the first stage suggests
MOST_GROWTH = 8  # times as many trials are predicted, at most
# in 5 % of studies a quantile in a gap has a narrow interval, always wrong: so that of
# another confidence has to be narrow, too; 1.7 times as wide of a smooth response
SURELY, AS_WIDE = 0.999, 1.75
STAGE_MULTIPLE = 256  # numbers of trials are multiples of it


class Statistic(NamedTuple):
    """A statistic of a response."""

    response: str
    kind: str  # "mean", "sigma", "quantile" or "beyond"
    share: float = math.nan  # share of a quantile

    def estimate(
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
        moments = as_sampled(values, sample).otherwise(wide)
        return moments.mean if self.kind == "mean" else moments.sigma


class Precision(NamedTuple):
    """A requested precision."""

    statistic: Statistic
    # half the width of its 95 % interval: SI, or a share of the number itself
    within: float
    relative: bool  # whether `within` is a share of the number

    def missing(self, estimate: Estimate) -> float:
        """Return half the interval over the requested half; at most 1 when reached."""
        if not estimate.sure:
            return math.inf
        requested = self.within * (abs(estimate.value) if self.relative else 1.0)
        half = (estimate.upper - estimate.lower) / 2
        if half == 0:
            return 0.0
        return half / requested if requested > 0 else math.inf


def trials_wanted(
    precisions: Sequence[Precision],
    responses: Mapping[str, Array],
    sample: Sample,
    limits: Mapping[str, Ends],
    ranges: Mapping[str, Ends],
) -> float:
    """Estimate how many trials are needed in all.

    Return 0 if all precisions are reached; otherwise the predicted number and a tenth
    more. The interval at eight times as many trials shows how it shrinks; above that it
    shrinks with the root of the trials. Infinite without an interval.
    """
    needed, trials = 0.0, len(sample.status)
    for precision in precisions:
        statistic = precision.statistic
        values, quantile = responses[statistic.response], statistic.kind == "quantile"
        ends = limits.get(statistic.response), ranges.get(statistic.response)
        missing = precision.missing(statistic.estimate(values, sample, *ends))
        if quantile:
            surely = statistic.estimate(values, sample, *ends, confidence=SURELY)
            missing = max(missing, precision.missing(surely) / AS_WIDE)
        if missing <= 1:
            continue
        # repeated trials neither average replicates nor move quantiles
        later = missing / math.sqrt(MOST_GROWTH)
        if not (sample.replicates or quantile):
            often = sample._replace(status=np.tile(sample.status, MOST_GROWTH))
            tiled = np.tile(values, MOST_GROWTH)
            later = precision.missing(statistic.estimate(tiled, often, *ends))
        needed = max(needed, RESERVE * _trials_until(missing, later) * trials)
    return needed


def _trials_until(missing: float, later: float) -> float:
    """Return the trials that reach a precision, over the trials so far.

    `missing`, above 1, is `Precision.missing`; `later` at eight times the trials.
    """
    if later > 1 or math.isinf(missing):
        return MOST_GROWTH * max(later, 1.0) ** 2
    # a power law between; no interval shrinks faster than the trials grow
    shrunk = min(missing / later, MOST_GROWTH) if later else MOST_GROWTH
    return float(missing ** (math.log(MOST_GROWTH) / math.log(shrunk)))


def next_stage(trials: int, needed: float) -> int:
    """Return the trials of the next stage: at most eight times as many as now.

    References
    ----------
    C. Stein, A two-sample test for a linear hypothesis whose power is independent of
    the variance, Ann. Math. Stat. 16 (1945) 243-258: few looks, far apart, keep
    the coverage of the last interval nearly nominal: see tests/studies/coverage.
    """
    most = min(needed, MOST_GROWTH * trials)
    return STAGE_MULTIPLE * math.ceil(most / STAGE_MULTIPLE)
