"""What is found out about a response of a run, as types. SI."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple, TypeVar

from tolstat.statistics.estimate import Estimate
from tolstat.statistics.point_mass import PointMass
from tolstat.statistics.sensitivity.contributions import Contributions
from tolstat.statistics.sensitivity.linear import Departure, Linear
from tolstat.statistics.sensitivity.out_of_limit import CLEAR
from tolstat.statistics.sensitivity.pairs import Together
from tolstat.statistics.summary import Limited, Summary
from tolstat.store.run_records import WorstCase
from tolstat.units.scale import Scale, share_words

T = TypeVar("T")
NEGLIGIBLE = 1e-3  # of the distance to the limit: a smaller range is not analysed


class Cause(NamedTuple):
    """One contributor, or kind of part, as a cause of out-of-limit trials."""

    shift: float  # how it differs among them, see `Difference`; NaN for a kind of part
    width: float
    # how often chance would make it differ so much, corrected for all tests of a limit;
    # of a kind of part that of its least clear member, unless it is named as a whole
    level: float
    halved: Estimate  # fraction out of limit with its tolerance, or all of it, halved
    effective_sample_size: int  # that this rests on; 0 without any

    @property
    def significant(self) -> bool:
        """Whether it differs by more than chance."""
        return self.level < CLEAR


class NamedCause(NamedTuple):
    """A named cause: a contributor, equivalent parts, or several only together."""

    words: str  # what is named
    members: tuple[str, ...]  # contributors
    level: float  # p-value, corrected for all tests of a limit
    halved: Estimate  # fraction out of limit with all these tolerances halved
    effective_sample_size: int  # that this rests on; 0 without any
    together: Together | None  # what several explain only together; None otherwise


class Causes(NamedTuple):
    """Main causes of out-of-limit trials."""

    trials_out_of_limit: int  # trials, failed ones among them
    reason: str  # why no cause is named; empty if one is
    needed: int  # trials in all that would tell, if these are too few; otherwise 0
    # the main cause first: the least change that meets the limit, if one is known to;
    # otherwise what explains most
    named: tuple[NamedCause, ...]
    contributors: Mapping[str, Cause]
    kinds: Mapping[str, Cause]

    @property
    def by_name(self) -> dict[str, Cause]:
        """Kinds of part and contributors by name."""
        return {**self.contributors, **self.kinds}

    @property
    def main(self) -> NamedCause | None:
        """The main cause; None if there is none."""
        return next(iter(self.named), None)

    @property
    def significant(self) -> list[str]:
        """Contributors that differ significantly, the clearest first."""
        clear = {n: x for n, x in self.contributors.items() if x.significant}
        return sorted(clear, key=lambda name: clear[name].level)


def by_name(mean: T, sigma: T, quantiles: Mapping[float, T]) -> dict[str, T]:
    """Return numbers of a response by name."""
    shares = {share_words(share): number for share, number in quantiles.items()}
    return {"mean": mean, "sigma": sigma, **shares}


class Effect(NamedTuple):
    """How far integration errors move the numbers of a response; NaN: not known."""

    mean: float
    sigma: float
    quantiles: Mapping[float, float]
    fraction_out_of_limit: float | None

    @property
    def numbers(self) -> dict[str, float]:
        """The numbers of the response by name."""
        return by_name(self.mean, self.sigma, self.quantiles)


class LargestError(NamedTuple):
    """Trials evaluated again for one reason, done both times; their largest error."""

    trials: int
    largest: float


class IntegrationErrors(NamedTuple):
    """The integration errors of a response, from the audit of the run."""

    trials: int  # evaluated again
    failed: int  # of these, one of the two times
    settings: Mapping[str, float]  # what was tightened, and to what
    largest: float  # error seen; no bound on that of any other trial
    at_random: LargestError  # of trials chosen at random
    # fraction whose error is above the largest of these, at most, with 95 % certainty;
    # NaN where trials depend on each other
    above: float
    # of trials chosen for this response: "near" its limit, the "worst", and "spread"
    chosen: Mapping[str, LargestError]
    effect: Effect | None  # None where it is unknown
    changed: int | None  # trials that change sides of the limit; None without one


class SobolIndices(NamedTuple):
    """Sobol' indices of a run made for them, from its whole groups of trials."""

    groups: int
    broken: int
    first: Mapping[str, Estimate]
    total: Mapping[str, Estimate]
    dominated_by_few: bool
    clipped: bool  # of the response clipped to the central 99 % of its trials

    @property
    def reason(self) -> str:
        """Why they are not shown; empty if they are."""
        if self.dominated_by_few:
            return "few trials dominate the variance"
        if any(share.value == share.value for share in self.first.values()):
            return ""
        return next((x.reason for x in self.total.values()), "nothing deviates")


class RequestedQuantiles(NamedTuple):
    """Quantiles of a reader's choice, and what lies between the outer two."""

    quantiles: Mapping[float, Estimate]  # by share
    share: float  # between the outermost; 0 of a single one
    # the shortest interval with this share of the trials, without interval of its own
    shortest: tuple[float, float]


class WorstTrial(NamedTuple):
    """One of the worst trials, with its most important deviations."""

    trial: int
    value: float
    precise: float
    deviations: Mapping[str, float]


@dataclass(frozen=True)
class DescribedResponse(Summary):
    """The statistics of a response of a run, and how it is shown."""

    nominal: float  # of the nominal trial; NaN if that failed
    sentence: str
    scale: Scale


@dataclass(frozen=True)
class ResponseSummary(DescribedResponse):
    """A response at the end of a run; weighted trials tell no causes."""

    causes: Causes | None  # None without a limit
    # of a response in focus, as the next; None where nothing deviates
    contributions: Contributions | None
    members: Mapping[str, tuple[str, ...]]  # of each kind of part

    @property
    def nothing(self) -> bool:
        """Whether it has no limit and is zero in every trial, the nominal one too."""
        return not self.limited and self.nominal == self.least == self.largest == 0

    @property
    def still(self) -> bool:
        """Whether no trial is out of limit, and the range nothing beside the limit."""
        if not self.limited or self.limited.yields.fraction_out_of_limit.value:
            return False
        lower, upper = self.limited.limit.permitted
        room = min(upper - self.largest, self.least - lower)
        return self.largest - self.least < NEGLIGIBLE * room

    @property
    def largest_share(self) -> tuple[str, Estimate] | None:
        """The largest variance contribution; None where few trials dominate."""
        contributions = self.contributions
        if contributions is None or contributions.dominated_by_few:
            return None
        grouped = {member for members in self.members.values() for member in members}
        alone = {n: x for n, x in contributions.first_order.items() if n not in grouped}
        shares = {**self.shares_of_kinds, **alone}
        clear = {n: x for n, x in shares.items() if x.value > 0 and not x.lower <= 0}
        name = max(clear, key=lambda name: clear[name].value, default="")
        return (name, clear[name]) if name else None

    @property
    def shares_of_kinds(self) -> dict[str, Estimate]:
        """The share of each kind of part: with interactions, where that is known."""
        if (shares := self.contributions) is None:
            return {}
        return {
            kind: together
            if together.value > 0 or not (alone := shares.groups[kind]).sure
            else alone._replace(upper=1.0)  # a sum of first orders: at least that much
            for kind, together in shares.together.items()
        }


def by_what_decides(responses: Mapping[str, ResponseSummary]) -> dict[str, Limited]:
    """Return the limited responses by what decides.

    Not met first, then most out of limit, then nearest to the limit (least Ppk by
    percentiles).
    """

    def rank(item: tuple[str, Limited]) -> tuple[int, float, float]:
        yields, ppk = item[1].yields, item[1].percentiles.ppk.value
        return *yields.urgency, math.inf if math.isnan(ppk) else ppk

    limits = {name: response.limited for name, response in responses.items()}
    return dict(sorted(((n, x) for n, x in limits.items() if x), key=rank))


@dataclass(frozen=True)
class ReportedResponse(ResponseSummary):
    """A response in a report."""

    symbol: str
    source: str
    integration_errors: IntegrationErrors | None  # None: not audited
    slopes: Mapping[str, float]  # at the nominal trial, by contributor that deviates
    # None without slopes, and where all are zero, and yet it varies
    root_sum_square: Linear | None
    departures: tuple[Departure, ...]  # how far that is off
    worst_cases: Mapping[str, WorstCase]  # by side, of a limited response
    worst_trials: tuple[WorstTrial, ...]  # the worst first, of a limited response
    # of a response in focus, as the next: the value that many trials share
    point_mass: PointMass | None
    indices: SobolIndices | None
    requested: RequestedQuantiles | None = None

    @property
    def no_linear_part(self) -> bool:
        """Whether it varies, and yet has no slope at the nominal trial."""
        unknown = self.root_sum_square is None
        return unknown and bool(self.slopes) and self.least < self.largest

    @property
    def leading(self) -> list[str]:
        """The contributors that matter to it, the most important first.

        If few trials dominate the variance, contributions are noise. Contributors that
        differ significantly among out-of-limit trials then come first, and ranks order
        the rest.
        """
        if (contributions := self.contributions) is None:
            return []
        by_ranks = contributions.dominated_by_few
        shares = (
            contributions.rank_regression if by_ranks else contributions.first_order
        )
        values = {n: x.value for n, x in shares.items() if x.value == x.value}
        first = self.causes.significant if by_ranks and self.causes else []
        rest = sorted(
            values, key=lambda n: -(abs(values[n]) if by_ranks else values[n])
        )
        return [name for name in dict.fromkeys([*first, *rest]) if name in values]
