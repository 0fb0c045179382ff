"""The yield of a limit, and its verdict."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from enum import StrEnum
from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array, Truths
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.integration_error import AuditedResponse
from tolstat.statistics.intervals.moments import Ends
from tolstat.statistics.intervals.weighted_estimates import unmet
from tolstat.statistics.limits.limit import DEMANDED, rounded_out, within
from tolstat.statistics.sample import Sample
from tolstat.statistics.sample_size import trials_needed


class Verdict(StrEnum):
    """Whether a limit is met."""

    MET = "met"
    NOT_MET = "not met"
    UNDECIDED = "undecided"


class Caveat(StrEnum):
    """Why a limit is undecided although trials would tell; or when it is met."""

    NONE = ""
    INTEGRATION_ERROR = "integration error"
    FAILED_AGAIN = "trials fail when evaluated again"
    JUMP = "the response jumps as an angle does"
    MISSED_KIND = "if no kind of failure was missed"
    FEW_PARTS = "few parts measured"
    NORMAL_PARTS = "if the parts are normal"
    LOGNORMAL_PARTS = "if the parts are lognormal"
    FITTED_PARTS = "if the parts are as fitted"

    @classmethod
    def of_parts(cls) -> tuple[Caveat, ...]:
        """Return the conditions on measured parts."""
        return cls.NORMAL_PARTS, cls.LOGNORMAL_PARTS, cls.FITTED_PARTS

    @classmethod
    def of_audit(cls) -> tuple[Caveat, ...]:
        """Return what the audit of a run shows."""
        return cls.INTEGRATION_ERROR, cls.FAILED_AGAIN


MET, NOT_MET, UNDECIDED = Verdict
OF_FITS = {
    "normal": Caveat.NORMAL_PARTS, "lognormal": Caveat.LOGNORMAL_PARTS,
}  # fmt: skip
INTEGRATION_ERROR, JUMP = Caveat.INTEGRATION_ERROR, Caveat.JUMP
WORST_FIRST = (NOT_MET, UNDECIDED, MET)


JOINT = ""  # in place of a response: all limits
DOMINATE = 0.8  # of the width of an interval: then more trials tell little


class PartsUncertainty(NamedTuple):
    """A fraction out of limit as uncertain as the measured parts.

    Attributes
    ----------
    entries : dict of str to int
        Measured parts by entry of the study.
    assumed : str
        The family that the interval assumes, "normal"; empty: it holds whatever the
        parts are.
    if_fitted, for_any : Estimate
        The fraction if the parts come from the fitted family, and whatever they are.
    of_parts : tuple of float
        Ends of the deciding interval without the error of the trials.
    needed : int
        Measured parts that would decide; 0 if it is decided, or a thousand would not.
        Of an entry of `lots` it counts lots, each with as many parts as now.
    lots : dict of str to int
        Measured lots by entry, where the mean errs more by lots than by parts.
    """

    entries: Mapping[str, int]
    assumed: str
    if_fitted: Estimate
    for_any: Estimate
    of_parts: tuple[float, float]
    needed: int = 0
    lots: Mapping[str, int] = {}

    @property
    def interval(self) -> Estimate:
        """The interval that decides."""
        return self.if_fitted if self.assumed else self.for_any

    @property
    def fewest(self) -> int:
        """Measured parts of the entry that has the fewest."""
        return min(self.entries.values())

    @property
    def counts(self) -> dict[str, tuple[int, str]]:
        """How many of what were measured, by entry: parts, or lots if these are few."""
        return {
            name: (self.lots[name], "lot") if name in self.lots else (parts, "part")
            for name, parts in self.entries.items()
        }

    def widened(self, share: Estimate) -> Estimate:
        """Return a fraction out of limit of the trials with both errors."""
        return _enclosed(share, self.interval)

    def for_any_parts(self, share: Estimate) -> Estimate:
        """Return the same, whatever the parts are."""
        return _enclosed(share, self.for_any)

    def dominates(self, share: Estimate) -> bool:
        """Whether more trials would leave a widened interval as wide."""
        lower, upper = self.of_parts
        return not share.sure or upper - lower >= DOMINATE * (share.upper - share.lower)


def _enclosed(share: Estimate, interval: Estimate) -> Estimate:
    if not interval.sure:
        return Estimate(share.value, reason=interval.reason)
    if not share.sure:
        return share
    ends = min(share.lower, interval.lower), max(share.upper, interval.upper)
    return Estimate(share.value, *ends)


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
    # how far the measured parts leave it in uncertainty; None without any
    measured: PartsUncertainty | None = None
    # largest share of a kind of failure that trials may have missed, where a verdict
    # rests on its condition
    missed: float = 0.0

    @property
    def reason_words(self) -> str:
        """Its reason, with the number of measured parts or lots."""
        if self.measured and self.reason == Caveat.FEW_PARTS:
            fewest, kind = min(self.measured.counts.values())
            return f"only {fewest} {kind}{'s' * (fewest > 1)} measured"
        return self.reason

    @property
    def words(self) -> str:
        """The verdict, and its reason where it has one."""
        return worded(self.verdict, self.reason_words)

    @property
    def urgency(self) -> tuple[int, float]:
        """Its rank, the least first: the worst verdict, then most out of limit."""
        return WORST_FIRST.index(self.verdict), -self.fraction_out_of_limit.value

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
    measured: PartsUncertainty | None = None,
) -> Yield:
    """Estimate the yield of a limit.

    `ends` are responses that integration errors allow, as of `response_ends`; `audited`
    is what the audit shows, None without one. `measured` is how uncertain it is by
    measured parts.

    For independent trials intervals are anytime-valid: adding trials until there is a
    verdict does not raise the error. Otherwise intervals come from replicates or
    weighted counts.
    """
    good = within(values, limit) & sample.done

    def share(units: Truths) -> Estimate:
        within_limit = _most(units, sample)
        if measured is None:
            return within_limit
        return measured.widened(within_limit.complement).complement

    judged, reason = judged_with(
        (ends, audited), limit, demanded, sample.done, good, share
    )
    out_of_limit = sample.share(~good, sample.ran)
    if measured:
        of_trials, out_of_limit = out_of_limit, measured.widened(out_of_limit)
        if not reason:
            reason = _caveat_of(measured, judged, (of_trials, out_of_limit), demanded)
    missed = _missed(sample) if judged == MET else 0.0
    if missed and out_of_limit.upper + missed > 1 - demanded:
        reason = Caveat.MISSED_KIND
    undecided = judged == UNDECIDED and not reason
    needed = trials_needed(good, sample, demanded) if undecided else 0
    most = share(good | ~sample.done)
    return Yield(
        out_of_limit, share(good), most, judged, needed, reason, measured,
        missed if reason is Caveat.MISSED_KIND else 0.0,
    )  # fmt: skip


def _missed(sample: Sample) -> float:
    """Return the largest share of a kind of failure that trials may have missed.

    0 where any kind has its chance.
    """
    if (weights := sample.weights) and weights.searched:
        return unmet(weights.values) + weights.cut
    thinned = sample.thinned
    return thinned.unseen if thinned and thinned.skips else 0.0


def _caveat_of(
    measured: PartsUncertainty,
    judged: Verdict,
    shares: tuple[Estimate, Estimate],
    demanded: float,
) -> Caveat:
    """Return on which condition of the measured parts a verdict holds.

    `shares` are out of limit: of the trials alone, and with both errors.
    """
    of_trials, both = shares
    if judged == UNDECIDED:
        settled = verdict(of_trials.complement, demanded) != UNDECIDED
        few = settled or measured.dominates(both)
        return Caveat.FEW_PARTS if few else Caveat.NONE
    any_parts = measured.for_any_parts(of_trials).complement
    if measured.assumed and verdict(any_parts, demanded) != judged:
        return OF_FITS.get(measured.assumed, Caveat.FITTED_PARTS)
    return Caveat.NONE


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
        (least, largest), (lower, upper) = ends, rounded_out(*limit)
        alternatives.append(done & (least >= lower) & (largest <= upper))
        alternatives.append((least <= upper) & (largest >= lower))
    if any(verdict(share(units), demanded) != judged for units in alternatives) or (
        audited
        and not audited.permits(judged == MET, 1 - within_limit.upper, 1 - demanded)
    ):
        failures = audited is not None and audited.only_failures
        return UNDECIDED, Caveat.FAILED_AGAIN if failures else INTEGRATION_ERROR
    return judged, Caveat.NONE


def joint_yield(
    responses: Mapping[str, Array],
    sample: Sample,
    limits: Mapping[str, Ends],
    measured: PartsUncertainty | None = None,
) -> Estimate:
    """Estimate the yield, all limits, of at least one limit by response, SI."""
    inside = [within(responses[name], limit) for name, limit in limits.items()]
    share = _most(np.all(inside, axis=0) & sample.done, sample)
    return measured.widened(share.complement).complement if measured else share


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
