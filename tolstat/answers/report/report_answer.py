"""What a run says, as types: the summary at its end, and the report. SI."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar, NamedTuple

from tolstat.answers.answer import Answer
from tolstat.answers.cells import summary_cells
from tolstat.document.blocks import Document
from tolstat.document.inline import Number
from tolstat.render.tables import Row
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.integration_error import VerdictChanges
from tolstat.statistics.limits.yields import MET, NOT_MET, UNDECIDED
from tolstat.statistics.point_mass import PointMass
from tolstat.statistics.sensitivity.contributions import Contributions
from tolstat.statistics.sensitivity.linear import Departure, Linear
from tolstat.statistics.sensitivity.out_of_limit import CLEAR
from tolstat.statistics.sensitivity.pairs import Together
from tolstat.statistics.summary import Summary
from tolstat.store.run_records import Chosen, WorstCase
from tolstat.store.stored_run import Run
from tolstat.units.scale import Scale

WORST_FIRST = (NOT_MET, UNDECIDED, MET)


class TrialCounts(NamedTuple):
    """What became of the trials.

    Attributes
    ----------
    requested, ran : int
        How many.
    done, failed, counted : int
        Of those that the statistics rest on; how many these are.
    by_status : dict of str to int
        By the word of each status.
    failures : Estimate
        Fraction that failed.
    unseen : float
        Fraction of production that may lie outside all trials that are done.
    sampling, promise : str
        How they were sampled, and what that allows to say.
    notes : tuple of str
        What must be known to read the numbers, failures first.
    """

    requested: int
    ran: int
    done: int
    failed: int
    counted: int
    by_status: Mapping[str, int]
    failures: Estimate
    unseen: float
    sampling: str
    promise: str
    notes: tuple[str, ...]


class AllLimits(NamedTuple):
    """All limits together.

    Attributes
    ----------
    limits : int
        How many there are.
    within : Estimate
        Yield: fraction within all of them at once.
    wrongly_met : float
        Greatest chance that one or more verdicts is wrongly "met"; for independent
        trials.
    """

    limits: int
    within: Estimate
    wrongly_met: float


class TitleBlock(NamedTuple):
    """What the study says of the sheet that is signed; empty texts if nothing."""

    project: str
    drawing: str
    revision: str
    author: str
    approval: str


class Cause(NamedTuple):
    """What one contributor, or kind of part, has to do with out-of-limit trials.

    Attributes
    ----------
    shift, width : float
        How it differs among them, see `Difference`; NaN for a kind of part.
    level : float
        How often chance would make it differ so much, corrected for the number of
        contributors; of a kind of part that of its clearest member.
    halved : Estimate
        Fraction out of limit with its tolerance halved; of a kind with all of them.
    effective_sample_size : int
        That this rests on; 0 without any.
    """

    shift: float
    width: float
    level: float
    halved: Estimate
    effective_sample_size: int

    @property
    def significant(self) -> bool:
        """Whether it differs by more than chance."""
        return self.level < CLEAR


class PairCause(NamedTuple):
    """Two contributors that together explain out-of-limit trials.

    Attributes
    ----------
    words : str
        What they do in these trials.
    together : Together
        How clearly, and in how many of them.
    halved : Estimate
        Fraction out of limit with both tolerances halved.
    effective_sample_size : int
        That this rests on; 0 without any.
    """

    words: str
    together: Together
    halved: Estimate
    effective_sample_size: int


class Causes(NamedTuple):
    """Main causes of out-of-limit trials.

    Attributes
    ----------
    out_of_limit : int
        Trials, failed ones among them.
    reason : str
        Why no cause is named; empty if one is.
    leading : tuple of str
        Kinds of part, and contributors of no kind, that differ significantly among
        these trials, the clearest first.
    contributors, kinds : dict of str to Cause
        By name.
    pairs : tuple of PairCause
        Pairs that explain more than either of them, what explains most first.
    """

    out_of_limit: int
    reason: str
    leading: tuple[str, ...]
    contributors: Mapping[str, Cause]
    kinds: Mapping[str, Cause]
    pairs: tuple[PairCause, ...] = ()

    @property
    def pair(self) -> PairCause | None:
        """The pair that is named: it explains more than any single contributor."""
        return next(self._explaining, None)

    @property
    def equivalent_pairs(self) -> tuple[PairCause, ...]:
        """Pairs that explain as much, as far as the trials tell: often equal parts."""
        first, *others = self._explaining
        least = first.together.far.value
        return tuple(each for each in others if each.together.far.upper >= least)

    @property
    def _explaining(self) -> Iterator[PairCause]:
        return (
            each
            for each in self.pairs
            if each.together.far.value > each.together.single
        )

    @property
    def main(self) -> Cause | PairCause | None:
        """What is named as the main cause; None where nothing is."""
        if self.pair or not self.leading:
            return self.pair
        name = self.leading[0]
        return self.kinds.get(name) or self.contributors[name]

    @property
    def significant(self) -> list[str]:
        """Contributors that differ significantly, the clearest first."""
        every = self.contributors
        return sorted(
            (name for name, each in every.items() if each.significant),
            key=lambda name: every[name].level,
        )


class Effect(NamedTuple):
    """How far integration errors move the numbers of a response; NaN: not known."""

    mean: float
    sigma: float
    quantiles: Mapping[float, float]
    out_of_limit: float | None


class LargestError(NamedTuple):
    """Trials evaluated again for one reason, done both times; their largest error."""

    trials: int
    largest: float


class IntegrationErrors(NamedTuple):
    """What the integration errors of a response are, by the audit of the run.

    Attributes
    ----------
    trials, failed : int
        Evaluated again, and how many of them failed one of the two times.
    settings : dict of str to float
        What was tightened, and to what.
    largest : float
        Largest error seen; no bound on that of any other trial.
    at_random : LargestError
        Of those that were chosen at random.
    above : float
        Fraction whose error is above the largest of these, at most, with 95 %
        certainty; NaN where trials depend on each other.
    chosen : dict of str to LargestError
        Of those chosen for this response: "near" its limit, the "worst", and "spread"
        over its range.
    effect : Effect or None
        None where no trial tells.
    sides : VerdictChanges or None
        Trials that change sides of the limit; None without one.
    """

    trials: int
    failed: int
    settings: Mapping[str, float]
    largest: float
    at_random: LargestError
    above: float
    chosen: Mapping[str, LargestError]
    effect: Effect | None
    sides: VerdictChanges | None


class SobolIndices(NamedTuple):
    """Sobol' indices of a run made for them, from its whole groups of trials."""

    groups: int
    broken: int
    first: Mapping[str, Estimate]
    total: Mapping[str, Estimate]
    dominated_by_few: bool


class WorstTrial(NamedTuple):
    """One of the worst trials, with what matters most of its deviations."""

    trial: int
    value: float
    precise: float
    deviations: Mapping[str, float]


@dataclass(frozen=True)
class ResponseSummary(Summary):
    """A response at the end of a run.

    Attributes
    ----------
    nominal : float
        Of the nominal trial; NaN if that failed.
    sentence : str
        What it is.
    scale : Scale
        How it is shown.
    causes : Causes or None
        Main causes of out-of-limit trials; None without a limit.
    """

    nominal: float
    sentence: str
    scale: Scale
    causes: Causes | None


@dataclass(frozen=True)
class ReportedResponse(ResponseSummary):
    """All that a report says of a response.

    Attributes
    ----------
    symbol, source : str
        As the model declares it.
    integration_errors : IntegrationErrors or None
        None where nothing was evaluated again.
    slopes : dict of str to float
        At the nominal trial, by contributor that deviates.
    linear : Linear or None
        Root sum square; None without slopes.
    departures : tuple of Departure
        How far that is off.
    worst_cases : dict of str to WorstCase
        By side, of a limited response.
    worst_trials : tuple of WorstTrial
        The worst first, of a limited response.
    point_mass : PointMass or None
        The value that many trials share; of a response in focus, as all that follow.
    contributions : Contributions or None
        Variance contributions.
    members : dict of str to tuple of str
        The contributors of each kind of part.
    indices : SobolIndices or None
        Of a run made for them.
    """

    symbol: str
    source: str
    integration_errors: IntegrationErrors | None
    slopes: Mapping[str, float]
    linear: Linear | None
    departures: tuple[Departure, ...]
    worst_cases: Mapping[str, WorstCase]
    worst_trials: tuple[WorstTrial, ...]
    point_mass: PointMass | None = None
    contributions: Contributions | None = None
    members: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    indices: SobolIndices | None = None

    @property
    def leading(self) -> list[str]:
        """The contributors that matter to it, the most important first.

        Where few trials dominate the variance its contributions are noise: what differs
        significantly among out-of-limit trials comes first then, and ranks order the
        rest.
        """
        if self.contributions is None:
            return []
        few = self.contributions.dominated_by_few
        known = {
            name: abs(each.value) if few else each.value
            for name, each in (
                self.contributions.rank_regression
                if few
                else self.contributions.first_order
            ).items()
        }
        told = [name for name, value in known.items() if value == value]
        first = self.causes.significant if few and self.causes else []
        first = [name for name in first if name in told]
        rest = sorted(set(told) - set(first), key=lambda n: (-known[n], told.index(n)))
        return first + rest


class SampledDeviation(NamedTuple):
    """What was assumed of a deviation: words, tolerance, how it is shown."""

    words: str
    lower: float
    upper: float
    scale: Scale
    sentence: str


class Assumptions(NamedTuple):
    """What the numbers rest on.

    Attributes
    ----------
    deviations : dict of str to SampledDeviation
        By contributor that deviates.
    correlation : dict
        Rank correlations, as the study has them.
    settings : dict of str to Chosen
        As they are written.
    of_the_model : tuple of str
        What the model's answers rest on.
    missing : str
        Why there are no slopes, worst cases and worst trials; empty if there are.
    """

    deviations: Mapping[str, SampledDeviation]
    correlation: Mapping[str, Mapping[str, float]]
    settings: Mapping[str, Chosen]
    of_the_model: tuple[str, ...]
    missing: str


class NumberOfStudy(NamedTuple):
    """A number of the study, SI, and how it is shown."""

    value: float
    scale: Scale
    sentence: str
    caveat: str


@dataclass(frozen=True, repr=False)
class RunSummary(Answer):
    """What a run says at its end.

    Attributes
    ----------
    title_block : TitleBlock
        What it is part of, and who answers for it.
    title, run, model : str
        What it is of.
    trials : TrialCounts
        What became of them.
    all_limits : AllLimits or None
        None without limits.
    responses : dict of str to ResponseSummary
        All of them.
    numbers : dict of str to NumberOfStudy
        Numbers of the study, equal for all its trials.
    of : Run
        The run itself; no part of the JSON.
    """

    title_block: TitleBlock
    title: str
    run: str
    model: str
    trials: TrialCounts
    all_limits: AllLimits | None
    responses: Mapping[str, ResponseSummary]
    numbers: Mapping[str, NumberOfStudy]
    of: Run = field(metadata={"json": False})
    answers: ClassVar[str] = "summary"

    @property
    def limited(self) -> list[str]:
        """The limited responses: not met first, then most out of limit."""

        def place(name: str) -> tuple[int, float]:
            limited = self.responses[name].limited
            assert limited
            judged = limited.yields
            return WORST_FIRST.index(judged.verdict), -judged.out_of_limit.value

        named = [name for name, each in self.responses.items() if each.limited]
        return sorted(named, key=place)

    @property
    def not_met(self) -> tuple[str, ...]:
        """The responses whose limit is not met."""
        return tuple(
            name
            for name, each in self.responses.items()
            if each.limited and each.limited.yields.verdict == NOT_MET
        )

    @property
    def short(self) -> str:
        """What it is, in a few words."""
        verdicts = [
            f"{name} {each.limited.yields.verdict}"
            for name, each in self.responses.items()
            if each.limited
        ]
        return f"{self.run}, {self.trials.done} trials; {', '.join(verdicts) or '-'}"

    def document(self) -> Document:
        """Return the first page, and the table of responses."""
        from tolstat.answers.report.first_page import summary_document

        return summary_document(self)

    def rows(self) -> Sequence[Row]:
        """Return a row for each response."""
        return [
            {
                "title": self.title,
                "response": name,
                "unit": each.scale.shown,
                "nominal [unit]": Number(each.nominal, each.scale),
                **summary_cells(each, each.scale),
                "trials done": self.trials.done,
                "trials failed": self.trials.failed,
            }
            for name, each in self.responses.items()
        ]


@dataclass(frozen=True, repr=False)
class Report(RunSummary):
    """The statistical tolerance report of a run.

    Attributes
    ----------
    responses : dict of str to ReportedResponse
        All of them.
    focus : tuple of str
        Responses in focus.
    assumptions : Assumptions
        What the numbers rest on.
    provenance : dict
        Versions, times, processor; the study as it was written.
    """

    responses: Mapping[str, ReportedResponse]
    focus: tuple[str, ...]
    assumptions: Assumptions
    provenance: Mapping[str, object]
    answers: ClassVar[str] = "report"

    def document(self) -> Document:
        """Return the report: first page, assumptions, summary, responses in focus."""
        from tolstat.answers.report.report_document import report_document

        return report_document(self)
