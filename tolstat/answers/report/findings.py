"""Everything a report says, as types: the page, JSON and CSV all print this. SI."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from tolstat.statistics.estimate import Estimate
from tolstat.statistics.limits.verdict_changes import Sides
from tolstat.statistics.sensitivity.contributions import Contributions
from tolstat.statistics.sensitivity.linear import Departure, Linear
from tolstat.statistics.sensitivity.out_of_limit import CLEAR
from tolstat.statistics.sensitivity.pairs import Together
from tolstat.statistics.shapes import Atom, Shape
from tolstat.statistics.summary import Summary
from tolstat.store.plan import Chosen
from tolstat.store.stored_diagnostics import WorstCase
from tolstat.units.scale import PART, Scale


class TrialsFindings(NamedTuple):
    """What became of the trials.

    Attributes
    ----------
    asked, ran : int
        How many.
    done, failed : int
        Of those that the statistics rest on.
    counted : int
        Trials that the statistics rest on.
    by_status : dict of str to int
        By the word of each status.
    failures : Estimate
        Share that failed.
    unseen : float
        Share of the machines that may lie beyond all trials that are done.
    sampling, promise : str
        How they were drawn, and what that allows to say.
    notes : tuple of str
        What must be known to read the numbers, failures first.
    """

    asked: int
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


class DistributionFindings(NamedTuple):
    """What a response looks like.

    Attributes
    ----------
    atom : Atom or None
        The value that many machines share.
    rest : int
        Machines that have another.
    shape : Shape
        The named distribution that is nearest to these, or why none was fitted.
    beyond : float
        Share of all machines done that would be beyond the limit if the rest were so
        distributed; NaN without a limit, and where the trials reject it.
    """

    atom: Atom | None
    rest: int
    shape: Shape
    beyond: float


class IndicesFindings(NamedTuple):
    """Sobol' indices of a run made for them, from its whole groups of trials.

    They are noise where a few machines decide the variance.
    """

    groups: int
    broken: int
    first: Mapping[str, Estimate]
    total: Mapping[str, Estimate]
    few_decide: bool


class Moves(NamedTuple):
    """How far integration errors move the numbers of a response; NaN: not known."""

    mean: float
    sigma: float
    quantiles: Mapping[float, float]
    beyond: float | None


class AuditedFindings(NamedTuple):
    """Trials evaluated again for one reason, done both times; their largest error."""

    trials: int
    largest: float


class IntegrationFindings(NamedTuple):
    """The second error bar.

    Attributes
    ----------
    trials, failed : int
        Evaluated again, and how many of them failed one of the two times.
    settings : dict of str to float
        What was tightened, and to what.
    largest : float
        Largest error of all of these: seen, and no bound on that of any other trial.
    at_random : AuditedFindings
        Those that were chosen at random.
    above : float
        Share of the machines whose error is above the largest of these, at most, with
        95 % certainty; NaN where trials depend on each other.
    chosen : dict of str to AuditedFindings
        Those that were chosen for this response: "near" its limit, the "worst", and
        "spread" over its range. A trial may be among several.
    moves : Moves or None
        None where no trial tells.
    sides : Sides or None
        Trials that change sides of the limit; None without one.
    """

    trials: int
    failed: int
    settings: Mapping[str, float]
    largest: float
    at_random: AuditedFindings
    above: float
    chosen: Mapping[str, AuditedFindings]
    moves: Moves | None
    sides: Sides | None


class WorstTrialFindings(NamedTuple):
    """One of the worst trials, with what matters most of its deviations."""

    trial: int
    value: float
    precise: float
    deviations: Mapping[str, float]


class Culprit(NamedTuple):
    """What one contributor, or kind of part, has to do with the machines beyond.

    Attributes
    ----------
    shift, width : float
        How it differs among them, see `Difference`; NaN for a kind of part.
    level : float
        How often chance would make it differ so much, corrected for the number of
        contributors; of a kind of part that of the member that differs most.
    halved : Estimate
        Share beyond with its tolerance halved; of a kind those of all its members.
    effective : int
        Number of trials that this rests on; 0 without any.
    """

    shift: float
    width: float
    level: float
    halved: Estimate
    effective: int

    @property
    def clear(self) -> bool:
        """Whether it differs by more than chance."""
        return self.level < CLEAR


class PairCulprit(NamedTuple):
    """Two contributors that together explain machines beyond, more than each alone.

    Attributes
    ----------
    words : str
        What they do in these machines.
    together : Together
        How clearly, and in how many of them.
    halved : Estimate
        Share beyond with the tolerances of both halved.
    effective : int
        Number of trials that this rests on; 0 without any.
    """

    words: str
    together: Together
    halved: Estimate
    effective: int

    def explained(self, beyond: int) -> str:
        """Say what they explain of so many machines beyond a limit."""
        far, *_ = PART.interval(*self.together.far[:3])
        return (
            f"far off (among the farthest {PART.number(self.together.of_all)} % of all "
            f"machines) in {far} % of these {beyond}; either "
            f"alone in {PART.at_most(self.together.alone)} % at most"
        )


class Culprits(NamedTuple):
    """Who drives the machines beyond a limit.

    Attributes
    ----------
    beyond : int
        Machines beyond, failed ones among them.
    reason : str
        Why it cannot be told who drives them; empty if it can.
    driving : tuple of str
        Kinds of part, and contributors of no kind, that clearly differ among them, the
        clearest first.
    contributors, kinds : dict of str to Culprit
        By name.
    pairs : tuple of PairCulprit
        Pairs of contributors that explain more than either of them, what explains most
        first.
    """

    beyond: int
    reason: str
    driving: tuple[str, ...]
    contributors: Mapping[str, Culprit]
    kinds: Mapping[str, Culprit]
    pairs: tuple[PairCulprit, ...] = ()

    @property
    def pair(self) -> PairCulprit | None:
        """The pair that is named first of all: it explains more than any single one."""
        return next(self._explaining, None)

    @property
    def likewise(self) -> tuple[PairCulprit, ...]:
        """Pairs that explain as much, for all that is known: alike parts, often."""
        first, *others = self._explaining
        least = first.together.far.value
        return tuple(each for each in others if each.together.far.upper >= least)

    @property
    def _explaining(self) -> Iterator[PairCulprit]:
        return (
            each
            for each in self.pairs
            if each.together.far.value > each.together.single
        )

    def sentence(self, response: str) -> str:
        """Say who drives the machines beyond a limit; empty where it cannot be told."""
        if self.pair:
            words = [each.words for each in (self.pair, *self.likewise)]
            said = self.pair.explained(self.beyond)
            return f"beyond {response}: {', likewise '.join(words)}: {said}"
        if not self.driving:
            return ""
        who = self.driving[0]
        verb = "differ" if who in self.kinds else "differs"
        return f"beyond {response}: {who} {verb} by more than chance"


@dataclass(frozen=True)
class ResponseFindings(Summary):
    """All that is said of a response, beyond its summary.

    Attributes
    ----------
    nominal : float
        Of the nominal machine; NaN if that failed.
    symbol, sentence, source : str
        As the machine declares it.
    scale : Scale
        How it is shown.
    integration_error : IntegrationFindings or None
        None where nothing was evaluated again.
    slopes : dict of str to float
        At the nominal machine, by contributor that deviates.
    linear : Linear or None
        The linear answer; None without slopes.
    departures : tuple of Departure
        How far that is off.
    worst_cases : dict of str to WorstCase
        By side, of a limited response.
    worst_trials : tuple of WorstTrialFindings
        The worst first, of a limited response.
    distribution, contributions, indices
        Of a response that is looked at closely.
    members : dict of str to tuple of str
        The contributors of each kind of part.
    culprits : Culprits or None
        Who drives the machines beyond its limit; None without a limit.
    """

    nominal: float
    symbol: str
    sentence: str
    source: str
    scale: Scale
    integration_error: IntegrationFindings | None = None
    slopes: Mapping[str, float] = field(default_factory=dict)
    linear: Linear | None = None
    departures: tuple[Departure, ...] = ()
    worst_cases: Mapping[str, WorstCase] = field(default_factory=dict)
    worst_trials: tuple[WorstTrialFindings, ...] = ()
    distribution: DistributionFindings | None = None
    contributions: Contributions | None = None
    members: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    indices: IndicesFindings | None = None
    culprits: Culprits | None = None


def leading_of(
    contributions: Contributions | None, culprits: Culprits | None = None
) -> list[str]:
    """Name the contributors that matter to a response, the most important first.

    Where a few machines decide the variance its shares are noise: what clearly differs
    among the machines beyond comes first then, and ranks order the rest.
    """
    if contributions is None:
        return []
    few = contributions.few_decide
    shares = contributions.rank_regression if few else contributions.first_order
    known = {n: abs(e.value) if few else e.value for n, e in shares.items()}
    told = [name for name in known if not math.isnan(known[name])]
    ordered = sorted(told, key=lambda name: -known[name])
    if few:
        first = [name for name in clear_of(culprits) if name in told]
        ordered = first + [name for name in ordered if name not in first]
    return ordered


def clear_of(culprits: Culprits | None) -> list[str]:
    """Name the contributors that clearly differ among the machines beyond."""
    every = culprits.contributors if culprits else {}
    clear = [name for name, each in every.items() if each.clear]
    return sorted(clear, key=lambda name: every[name].level)


class DeviationFindings(NamedTuple):
    """What was assumed of a deviation: words, tolerance, how it is shown."""

    words: str
    lower: float
    upper: float
    scale: Scale
    sentence: str


class Assumptions(NamedTuple):
    """What the numbers hang on.

    Attributes
    ----------
    deviations : dict of str to DeviationFindings
        By contributor that deviates.
    correlation : dict
        Rank correlations, as the study has them.
    settings : dict of str to Chosen
        As they are written.
    of_the_model : tuple of str
        What the machine's answers rest on.
    missing : str
        Why there are no slopes, worst cases and worst trials; empty if there are.
    """

    deviations: Mapping[str, DeviationFindings]
    correlation: Mapping[str, Mapping[str, float]]
    settings: Mapping[str, Chosen]
    of_the_model: tuple[str, ...]
    missing: str


class NumberFindings(NamedTuple):
    """A number of the study, SI, and how it is shown."""

    value: float
    scale: Scale
    sentence: str
    caveat: str


class JointFindings(NamedTuple):
    """All limits together.

    Attributes
    ----------
    limits : int
        How many there are.
    within : Estimate
        Share of the machines that are within all of them at once.
    wrongly : float
        Greatest chance that one or more of all verdicts is wrongly "met"; holds for
        independent trials.
    """

    limits: int
    within: Estimate
    wrongly: float


class DocumentFindings(NamedTuple):
    """What the study says of the sheet that is signed; empty texts if nothing."""

    project: str
    drawing: str
    revision: str
    author: str
    approval: str


@dataclass(frozen=True)
class Findings:
    """What a report says of a run.

    Attributes
    ----------
    document : DocumentFindings
        What it is part of, and who answers for it.
    title, run, model : str
        What it is of.
    machine : str
        FILE.py:NAME of a machine of one's own; empty for an installed one.
    trials : TrialsFindings
        What became of them.
    joint : JointFindings or None
        None without limits.
    interest : tuple of str
        Responses that are looked at closely.
    responses : dict of str to ResponseFindings
        All of them.
    numbers : dict of str to NumberFindings
        Numbers of the study, alike for all its machines.
    assumptions : Assumptions
        What the numbers hang on.
    provenance : dict
        Versions, times, processor; the study as it was written.
    """

    document: DocumentFindings
    title: str
    run: str
    model: str
    machine: str
    trials: TrialsFindings
    joint: JointFindings | None
    interest: tuple[str, ...]
    responses: Mapping[str, ResponseFindings]
    numbers: Mapping[str, NumberFindings]
    assumptions: Assumptions
    provenance: Mapping[str, object]
