"""The yield of a limit, its verdict, and the number of trials that decides it."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Callable, Mapping
from enum import StrEnum
from typing import NamedTuple

import numpy as np
from scipy.special import bdtr, betaincinv, ndtr

from tolstat.arrays import Array, Integers, Truths
from tolstat.statistics.estimate import CONFIDENCE, Estimate
from tolstat.statistics.integration_error import AuditedResponse
from tolstat.statistics.intervals.replicates import (
    LEAST_IN_EACH,
    half_width,
    missing,
    never_met,
)
from tolstat.statistics.intervals.shares import PRIOR, evidence_against
from tolstat.statistics.intervals.weighted_estimates import unmet
from tolstat.statistics.limits.limit import DEMANDED, within
from tolstat.statistics.sample import Sample

CHANCE = 0.8  # that the printed number of trials decides
GROWTH = 1.25  # ratio of successive numbers of trials that are tried
MOST_TRIALS = 10**9
POSTERIOR = 200  # shares that represent the posterior


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


def replicates_that_decide(
    machines: Truths, replicate: Integers, demanded: float
) -> int:
    """Return how many trials decide whether a share is as large as demanded.

    The least number, in steps of a quarter, that decides with a chance of 80 %; 0 above
    1e9. The scatter of replicates is assumed to fall with the root of the trials. If
    replicates are too small, the number that makes them large enough. Arguments as of
    `share_from_replicates`.
    """
    values = machines.astype(np.float64)
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


Ends = tuple[float, float]


class Verdict(StrEnum):
    """Whether a limit is met."""

    MET = "met"
    NOT_MET = "not met"
    UNDECIDED = "undecided"


class Caveat(StrEnum):
    """Why a limit is undecided although trials would tell; or when it is met."""

    NONE = ""
    INTEGRATION_ERROR = "integration error"
    JUMP = "the response jumps as an angle does"
    MISSED_KIND = "if no kind of failure was missed"


MET, NOT_MET, UNDECIDED = Verdict
INTEGRATION_ERROR, JUMP = Caveat.INTEGRATION_ERROR, Caveat.JUMP
WORST_FIRST = (NOT_MET, UNDECIDED, MET)


class Yield(NamedTuple):
    """The share of units within a limit."""

    fraction_out_of_limit: Estimate  # every failed trial counts as out of limit
    # yield if every failed trial were out of limit, and if every one were within
    within: Estimate
    within_at_most: Estimate
    # "met" when the whole interval of the yield lies at or above the demanded one, "not
    # met" when it lies below, else "undecided"; failed trials count against. Also
    # "undecided" if integration errors can change it.
    verdict: Verdict
    # trials that decide an undecided verdict with a chance of 80 %; 0 otherwise, above
    # 1e9, and if integration errors leave it undecided
    needed: int
    reason: Caveat = Caveat.NONE  # why it is undecided although trials would tell

    @property
    def words(self) -> str:
        """The verdict, and its reason where it has one."""
        return worded(self.verdict, self.reason)

    @property
    def jumping(self) -> Yield:
        """The same of a response that jumps as an angle: trials decide nothing."""
        return self._replace(verdict=UNDECIDED, needed=0, reason=JUMP)


def yield_of(
    values: Array,
    sample: Sample,
    limit: Ends,
    demanded: float = DEMANDED,
    ends: Array | None = None,
    audited: AuditedResponse | None = None,
) -> Yield:
    """Estimate the yield of a limit.

    `ends` are responses that integration errors allow, as of `response_ends`; `audited`
    is what the audit shows, None without one.

    For independent trials intervals are anytime-valid: adding trials until there is a
    verdict does not raise the error. Otherwise intervals come from replicates or
    weighted counts.
    """
    ran = sample.ran
    good = within(values, limit) & sample.done
    least = _most(good, sample)
    judged, reason = judged_with(
        (ends, audited), limit, demanded, sample.done, good,
        lambda units: _most(units, sample),
    )  # fmt: skip
    out_of_limit = sample.share(~good, ran)
    if (weights := sample.weights) and weights.searched and judged == MET:
        missed = unmet(weights.values) + weights.cut
        if out_of_limit.upper + missed > 1 - demanded:
            reason = Caveat.MISSED_KIND
    needed, more = 0, judged == UNDECIDED and not reason
    if more and sample.replicates:
        needed = replicates_that_decide(good[ran], sample.replicate[ran], demanded)
    elif more and not sample.weights:
        out, trials = np.count_nonzero(ran & ~good), np.count_nonzero(ran)
        needed = trials_that_decide(int(out), int(trials), 1 - demanded)
        needed = grown(needed * sample.each) if needed else 0
    most = _most(good | ~sample.done, sample)
    return Yield(out_of_limit, least, most, judged, needed, reason)


def judged_with(
    errors: tuple[Array | None, AuditedResponse | None],
    limit: Ends,
    demanded: float,
    done: Truths,
    good: Truths,
    share: Callable[[Truths], Estimate],
) -> tuple[Verdict, Caveat]:
    """Return a verdict, and why it is undecided if integration errors can change it.

    It has to be the same for the trials `good` within the limit, for those within it
    whatever their errors, and for those that some error puts within. And the audit has
    to permit it. `errors` are `ends` and `audited` of `yield_of`; `share` estimates a
    yield.
    """
    (ends, audited), within_limit = errors, share(good)
    judged, alternatives = verdict(within_limit, demanded), list[Truths]()
    if ends is not None:
        (least, largest), (lower, upper) = ends, limit
        alternatives.append(done & (least >= lower) & (largest <= upper))
        alternatives.append((least <= upper) & (largest >= lower))
    if any(verdict(share(units), demanded) != judged for units in alternatives) or (
        audited
        and not audited.permits(judged == MET, 1 - within_limit.upper, 1 - demanded)
    ):
        return UNDECIDED, INTEGRATION_ERROR
    return judged, Caveat.NONE


def joint_yield(
    responses: Mapping[str, Array], sample: Sample, limits: Mapping[str, Ends]
) -> Estimate:
    """Estimate the yield, all limits, of at least one limit by response, SI."""
    inside = [within(responses[name], limit) for name, limit in limits.items()]
    return _most(np.all(inside, axis=0) & sample.done, sample)


def worded(verdict: str, reason: str) -> str:
    """Return a verdict with its reason, or with the condition on which it holds."""
    return f"{verdict} ({reason})" if reason else verdict


def verdict(share: Estimate, demanded: float) -> Verdict:
    """Return the verdict on a yield; undecided without an interval."""
    if share.lower >= demanded:
        return MET
    return NOT_MET if share.upper < demanded else UNDECIDED


def _most(units: Truths, sample: Sample) -> Estimate:
    """Estimate a share of the trials that ran, expected to be most of them."""
    if sample.weights:
        return sample.share(~units, sample.ran).complement
    return sample.share(units, sample.ran)
