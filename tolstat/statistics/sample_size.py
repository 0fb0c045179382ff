"""How many trials reach a requested precision, or decide whether a limit is met."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from scipy.special import bdtr, betaincinv, ndtr

from tolstat.arrays import Array, Integers, Truths
from tolstat.statistics.estimate import CONFIDENCE, Estimate
from tolstat.statistics.intervals.moments import Ends, Reach
from tolstat.statistics.intervals.replicates import (
    LEAST_IN_EACH,
    half_width,
    missing,
    never_met,
)
from tolstat.statistics.intervals.shares import PRIOR, anytime_valid, evidence_against
from tolstat.statistics.limits.limit import within
from tolstat.statistics.sample import Sample, as_sampled, for_any, quantiles_at

DECIDE = "decide"  # how a rule begins that asks for the verdict of every limit
MOST_ROWS = 4_000_000  # trials of such a run that has a time, at most
FIRST_STAGE = 1024  # trials of the first stage
FEWEST_RANDOM = 2 * FIRST_STAGE  # trials before thinned ones
MOST_PLAIN = 60_000  # trials of equations of motion: about a minute
RESERVE = 1.1  # times the trials that the first stage suggests
MOST_GROWTH = 8  # times as many trials are predicted, at most
# in 5 % of studies a quantile in a gap has a narrow interval, always wrong: so that of
# another confidence has to be narrow, too; 1.7 times as wide of a smooth response
SURELY, AS_WIDE = 0.999, 1.75
STAGE_MULTIPLE = 256  # numbers of trials are multiples of it

CHANCE = 0.8  # that the printed number of trials decides
TAILS = (1 - CHANCE) / 2, (1 + CHANCE) / 2
GROWTH = 1.25  # ratio of successive numbers of trials that are tried
MOST_TRIALS = 10**9
POSTERIOR = 200  # shares that represent the posterior


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
            good = within(values, limit) & sample.done
            return sample.share(~good, sample.ran)
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


def is_thinned(further: float, *, isolated: bool, integrates: bool) -> bool:
    """Return whether so many further trials are thinned where a study does not say.

    Only the kind of its model counts, not how fast a machine is: so a study has the
    same trials on all machines. One evaluated in other processes is slow.
    """
    return isolated or (integrates and further > MOST_PLAIN)


def trials_needed(good: Truths, sample: Sample, demanded: float) -> int:
    """Return how many trials decide whether a yield is as large as demanded.

    0 above 1e9, and for weighted trials, of which that is not known. `good` tells which
    trials are within the limit.
    """
    ran = sample.ran
    if sample.replicates:
        return replicates_that_decide(good[ran], sample.replicate[ran], demanded)
    if sample.weights:
        return 0
    if sample.thinned:
        from tolstat.statistics.deciding.thinned_share import trials_settling  # seldom

        settled = trials_settling(~good, sample.thinned, 1 - demanded)
        return grown(settled) if settled < MOST_TRIALS else 0
    out, trials = np.count_nonzero(ran & ~good), np.count_nonzero(ran)
    needed = trials_that_decide(int(out), int(trials), 1 - demanded)
    return grown(needed * sample.each) if needed else 0


def trials_that_decide(count: int, trials: int, share: float) -> int:
    """Return how many trials decide whether a property is rarer than a share.

    The least number, in steps of a quarter, that decides with a chance of 80 % over
    Jeffreys' posterior. At this number the property can be found rarer. 0 above 1e9.
    Arguments as of `anytime_valid`.
    """
    evidence = math.log(2 / (1 - CONFIDENCE))
    a, b = count + PRIOR, trials - count + PRIOR
    possible = betaincinv(a, b, (np.arange(POSTERIOR) + 0.5) / POSTERIOR)

    def decides(growth: int) -> bool:
        n = grown(trials * GROWTH**growth)
        fewest, most = _deciding(n, share, evidence)
        if fewest < count:  # not met even if no further unit is out of limit
            return False
        rarer = _at_most(fewest - count, n - trials, possible)
        oftener = 1 - _at_most(most - count - 1, n - trials, possible)
        return float(np.mean(rarer + oftener)) >= CHANCE

    most = math.ceil(math.log(MOST_TRIALS / trials, GROWTH))
    growth = 1 + bisect_left(range(1, most + 1), True, key=decides)
    return grown(trials * GROWTH**growth) if growth <= most else 0


def trials_enough(count: int, trials: int, share: float, planned: int) -> int:
    """Return how many trials are likely to decide: `planned` if these do, else more.

    They do if they decide with as large a part out of limit as `count` of `trials`.
    Arguments and more as of `trials_that_decide`.
    """
    part = count / trials
    if _decide(planned, share, part, part):
        return planned
    return max(planned, trials_that_decide(count, trials, share))


def surely_decide(count: int, trials: int, share: float, planned: int) -> bool:
    """Return whether so many planned trials decide wherever the interval has the truth.

    Arguments as of `trials_enough`.
    """
    surely = anytime_valid(count, trials)
    return _decide(planned, share, surely.lower, surely.upper)


def trials_likely_enough(
    count: int, trials: int, share: float, planned: int, most: int
) -> int:
    """Return how many trials decide all over the middle 80 % of Jeffreys' posterior.

    `planned` if these do; about `most` at most. Other arguments as of `trials_enough`.
    """
    ends = betaincinv(count + PRIOR, trials - count + PRIOR, TAILS)
    if _decide(planned, share, *ends):
        return planned
    if (needed := trials_that_decide(count, trials, share)) > planned:
        return needed
    while planned < most and not _decide(planned, share, *ends):
        planned = grown(GROWTH * planned)
    return planned


def _decide(trials: int, share: float, least: float, largest: float) -> bool:
    """Return whether trials decide, if a fraction is one of these two.

    They do if both give the same verdict.
    """
    few, many = (
        anytime_valid(min(round(x * trials), trials), trials) for x in (least, largest)
    )
    return many.upper <= share or few.lower > share


def fewest_trials(share: float, times: int = 1) -> int:
    """Return how many trials show that a property is rarer than a share, without one.

    The least number, to two digits, of which so many times as many do.
    """
    fewest = 1
    while (upper := anytime_valid(0, times * fewest).upper) > share:
        fewest = grown(fewest * upper / share)
    return fewest


def replicates_that_decide(units: Truths, replicate: Integers, demanded: float) -> int:
    """Return how many trials decide whether a share is as large as demanded.

    The least number, in steps of a quarter, that decides with a chance of 80 %; 0 above
    1e9. The scatter of replicates is assumed to fall with the root of the trials. If
    replicates are too small, the number that makes them large enough. Arguments as of
    `share_from_replicates`.
    """
    values = units.astype(np.float64)
    if missing(values, replicate):
        return grown(LEAST_IN_EACH * max(int(replicate.max(initial=0)) + 1, 2))
    share, n = float(values.mean()), len(values)
    shares = np.bincount(replicate, values) / np.bincount(replicate)
    half = half_width(shares)
    error = float(shares.std(ddof=1)) / math.sqrt(len(shares))
    rare = never_met(n, len(shares))
    trials = n
    while (trials := math.ceil(GROWTH * trials)) <= MOST_TRIALS:
        part = n / trials
        wide, beyond = half * math.sqrt(part), rare * part
        # the later estimate differs from the present one, and from the truth
        scatter = max(error * math.sqrt(1 + part), 1e-12)
        met = ndtr((share - wide - beyond * share - demanded) / scatter)
        missed = ndtr((demanded - share - wide - beyond * (1 - share)) / scatter)
        if met + missed >= CHANCE:
            return grown(trials)
    return 0


def grown(n: float) -> int:
    """Round a number of trials up to two digits."""
    unit: int = 10 ** max(math.floor(math.log10(n)) - 1, 0)
    return unit * math.ceil(n / unit)


def _deciding(trials: int, share: float, evidence: float) -> tuple[int, int]:
    """Return the largest count that meets a share, and the least that misses it."""
    middle = math.floor(share * trials) + 1

    def rarer(count: int) -> bool:
        return evidence_against(count, trials, share) >= evidence

    def oftener(count: int) -> bool:
        return evidence_against(trials - count, trials, 1 - share) >= evidence

    to, beyond = range(middle), range(middle, trials + 1)
    fewest = bisect_left(to, True, key=lambda count: not rarer(count)) - 1
    return fewest, middle + bisect_left(beyond, True, key=oftener)


def _at_most(count: int, trials: int, shares: Array) -> Array:
    """Return the probabilities of at most `count` of `trials`, at shares."""
    if count < 0:
        return np.zeros_like(shares)
    return np.asarray(bdtr(min(count, trials), trials, shares))
