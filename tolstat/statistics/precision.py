"""A requested precision, and the number of trials that reaches it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array
from tolstat.statistics.estimate import CONFIDENCE, Estimate
from tolstat.statistics.intervals.moments import Ends, Reach
from tolstat.statistics.limits.yields import yield_of
from tolstat.statistics.sample import Sample, as_sampled, for_any, quantiles_at

FIRST = 1024  # trials of the first stage
RESERVE = 1.1  # times the trials that the first stage suggests
AHEAD = 8  # times as many trials are predicted, at most
# in 5 % of studies a quantile in a gap has a narrow interval, always wrong: so that of
# another confidence has to be narrow, too; 1.7 times as wide of a smooth response
SURELY, AS_WIDE = 0.999, 1.75
MULTIPLE = 256  # numbers of trials are multiples of it


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
        wanted = self.within * (abs(estimate.value) if self.relative else 1.0)
        half = (estimate.upper - estimate.lower) / 2
        if half == 0:
            return 0.0
        return half / wanted if wanted > 0 else math.inf


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
    wanted, trials = 0.0, len(sample.status)
    for each in precisions:
        name = each.statistic.response
        of = partial(
            each.statistic.of, limit=limits.get(name), declared=ranges.get(name)
        )
        now = each.missing(of(responses[name], sample))
        if each.statistic.kind == "quantile":
            surely = of(responses[name], sample, confidence=SURELY)
            now = max(now, each.missing(surely) / AS_WIDE)
        if now <= 1:
            continue
        # repeated trials neither average replicates nor move quantiles
        then = now / math.sqrt(AHEAD)
        if not sample.replicates and each.statistic.kind != "quantile":
            often = sample._replace(status=np.tile(sample.status, AHEAD))
            then = each.missing(of(np.tile(responses[name], AHEAD), often))
        wanted = max(wanted, RESERVE * _trials_until(now, then) * trials)
    return wanted


def _trials_until(now: float, then: float) -> float:
    """Return the trials that reach a precision, over the trials so far.

    `now`, above 1, is `Precision.missing`; `then` is it at eight times as many trials.
    """
    if then > 1 or math.isinf(now):
        return AHEAD * max(then, 1.0) ** 2
    # a power law between; no interval shrinks faster than the trials grow
    shrunk = min(now / then, AHEAD) if then else AHEAD
    return float(now ** (math.log(AHEAD) / math.log(shrunk)))


def next_stage(trials: int, wanted: float) -> int:
    """Return the trials of the next stage: at most eight times as many as now.

    References
    ----------
    C. Stein, A two-sample test for a linear hypothesis whose power is independent of
    the variance, Ann. Math. Stat. 16 (1945) 243-258: few looks, far apart, keep
    the coverage of the last interval nearly nominal; measured in tests/coverage.
    """
    most = min(wanted, AHEAD * trials)
    return MULTIPLE * math.ceil(most / MULTIPLE)
