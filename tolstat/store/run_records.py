"""Records of a run: its plan, known before the first trial, and results at the end."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import IntFlag
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.arrays import Array, Truths
from tolstat.integrator.problem import Residual as Residual
from tolstat.model.description import Contributor, Response, StudyNumber
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.integration_error import AuditedResponse
from tolstat.statistics.limits.limit import Limit
from tolstat.statistics.measured.populations import MeasuredSample
from tolstat.statistics.sample_size import DECIDE
from tolstat.store.assumed import Assumed
from tolstat.store.stored_fields import ELSEWHERE, Stored
from tolstat.toml import toml_table

LISTED = ("grid", "table")  # samplings of studies that list their trials
STATUS, STEPS = "status", "steps"  # columns that trials fill, beside the responses
Members = tuple[str, ...]  # contributors, taken together


@dataclass(frozen=True)
class StudyText:
    """The study that a run was made from: its text, as it was written."""

    text: str

    @cached_property
    def table(self) -> dict[str, Any]:
        """The text, read as TOML."""
        return toml_table(self.text)

    @property
    def trials(self) -> int | None:
        """Number of trials requested; None with a stopping rule or without one."""
        trials = self.table.get("trials")
        return trials if isinstance(trials, int) else None

    @property
    def seed(self) -> int | None:
        """Its seed; None where it has none."""
        return self.table.get("seed")


class Chosen(NamedTuple):
    """A setting: its value as written, what it is, and whether the study gave it."""

    words: str
    sentence: str
    given: bool


class Swept(NamedTuple):
    """A setting that a grid changes; fields as of `Contributor`."""

    name: str
    unit: str
    sentence: str
    shown: str


class DrawDetail(NamedTuple):
    """A column of the sampler about each trial; fields as of `Contributor`."""

    name: str
    unit: str
    sentence: str


class Sampled(NamedTuple):
    """How the trials were sampled."""

    seed: int  # from which all random numbers come; 0 of the rows of a file
    promise: str  # what may be said about intervals
    replicates: int  # independent randomisations; 0 where every trial is independent
    group: int  # trials that belong together
    # what varies independently, in the order of sampling
    factors: tuple[str, ...]
    sample: bool  # whether the trials are a sample of production
    aim: str  # the response whose limit is searched; empty without a search


class Reference(NamedTuple):
    """Known points of a publication or a measurement."""

    label: str  # where they come from
    # float64[point]: the swept contributor or setting first, then responses, SI
    columns: Mapping[str, Array]


class Isolation(NamedTuple):
    """How trials were evaluated in processes of their own."""

    longest_trial: float  # s, that a trial may last; 0 while that is not known
    # by trial, the first ones that failed: what they printed last, or why they failed
    output: Mapping[int, str] = {}


@dataclass(frozen=True, kw_only=True)
class Plan:
    """What a run is asked to do: its columns, limits, sampling, settings and source.

    Attributes
    ----------
    study : StudyText
        The text of the study.
    study_file : Path or None
        Path of the study; None if it is not a file.
    title, model, sampling : str
        Of the study.
    machine : str
        FILE.py:NAME of a custom model; empty for an installed one.
    source_digest : str
        Digest of the source that decides the numbers.
    document : dict of str to str
        The title block of the study: "project", "drawing", and so on.
    sampled : Sampled or None
        How the trials are sampled; None where the study lists them.
    rules : tuple of str
        The stopping rule, as it is written; empty without one.
    contributors, responses : tuple
        The columns, in order, with units and sentences.
    swept : tuple of Swept
        Settings that a grid changes.
    details : tuple of DrawDetail
        Columns of the sampler about each trial.
    settings : dict of str to Chosen
        All settings of the model, as they are written.
    limits : dict of str to Limit
        By response, SI.
    assumed : dict of str to Assumed
        By contributor that deviates.
    measured : tuple of MeasuredSample
        Measured parts that deviations are sampled from.
    correlation : dict of str to dict of str to float
        Rank correlations, as the study writes them.
    independent : bool
        Whether all deviations are independent: no correlation, nothing in common.
    words : dict of int to str
        The word of each status that a trial can have.
    grid : tuple of str
        What a grid sweeps, the slowest first; empty for any other run.
    reference : Reference or None
        Known points to be shown beside a grid.
    numbers : tuple of StudyNumber
        Numbers of the study, shown beside those of its trials.
    notes, assumptions : tuple of str
        Notes on the run and its deviations; assumptions of the model.
    isolation : Isolation or None
        How trials were evaluated in processes of their own; None if they were not.
    warnings : tuple of str
        What readers have to know before its verdicts, from its study.
    made : dict of str to str
        Versions, processor, platform, command, and when it was started.
    """

    study: StudyText
    study_file: Annotated[Path | None, ELSEWHERE]
    title: str
    model: str
    sampling: str
    machine: str
    source_digest: str
    document: Annotated[dict[str, str], Stored("title-block")]
    sampled: Sampled | None
    rules: tuple[str, ...]
    contributors: Annotated[tuple[Contributor, ...], Stored(columns="")]
    responses: Annotated[tuple[Response, ...], Stored(columns="")]
    swept: Annotated[tuple[Swept, ...], Stored(columns="")]
    details: Annotated[tuple[DrawDetail, ...], Stored(columns="")]
    settings: dict[str, Chosen]
    limits: Annotated[dict[str, Limit], Stored(columns="limit_")]
    assumed: Annotated[
        dict[str, Assumed],
        Stored(
            axes=("contributor",),
            sentence="distributions of the deviations, SI, with their quantiles at 513 "
            "normal scores from -8 to 8",
        ),
    ]
    measured: tuple[MeasuredSample, ...]
    correlation: Annotated[
        dict[str, dict[str, float]],
        Stored(
            "rank-correlation",
            axes=("contributor", "other"),
            sentence="rank correlations between contributors, as typed",
        ),
    ]
    independent: bool
    words: Annotated[dict[int, str], Stored("status-words")]
    grid: tuple[str, ...]
    reference: Reference | None
    numbers: tuple[StudyNumber, ...]
    notes: tuple[str, ...]
    assumptions: tuple[str, ...]
    made: Annotated[dict[str, str], Stored("provenance")]
    isolation: Isolation | None = None
    warnings: tuple[str, ...] = ()

    @property
    def aim(self) -> str:
        """The response whose limit is searched; empty without a search."""
        return self.sampled.aim if self.sampled else ""

    @property
    def listed(self) -> bool:
        """Whether the study lists its trials; they have no seed, then."""
        return self.sampling in LISTED

    @property
    def described(self) -> Sequence[Swept | Contributor | Response]:
        """Swept settings, contributors and responses."""
        return [*self.swept, *self.contributors, *self.responses]

    @cached_property
    def units(self) -> dict[str, str]:
        """SI unit of each column; "1" where there is none."""
        return {column.name: column.unit for column in self.described}

    @property
    def entries(self) -> dict[str, dict[str, str]]:
        """Settings, limits and deviations by name, as they are written."""
        return {
            "setting": {name: chosen.words for name, chosen in self.settings.items()},
            "limit": {name: limit.words for name, limit in self.limits.items()},
            "deviation": {name: part.words for name, part in self.assumed.items()},
        }

    @property
    def input_names(self) -> list[str]:
        """Names of the columns that are sampled before a trial runs."""
        columns = (self.swept, self.contributors, self.details)
        return [column.name for group in columns for column in group]


class Stopped(NamedTuple):
    """How a stopping rule ended a run."""

    rules: tuple[str, ...]  # as they are written: `Run.rules`
    reached: bool  # whether all of them were met
    stages: tuple[int, ...]  # numbers of trials at which they were evaluated
    at_most: int  # most trials allowed
    # trials that the rule needed at its last look: 0 if it was met, infinite if there
    # was no interval yet
    wanted: float = 0.0

    @property
    def decides(self) -> bool:
        """Whether the rule asks for the verdict of every limit."""
        return self.rules[0].startswith(DECIDE)


class Reason(IntFlag):
    """Why a response had a trial evaluated again; there may be several reasons."""

    NEAR = 1  # next to an end of its limit, or so near that an error may cross it
    WORST = 2  # nearest to the limit from within, or farthest out of limit
    SPREAD = 4  # one of those spread over its range, the least and the largest included
    OUT = 8  # a random one of those out of limit


@dataclass(frozen=True)
class Audited:
    """Trials that were evaluated again, more precisely."""

    trials: NDArray[np.int64]  # int64[n]: their numbers, ascending
    settings: Mapping[str, float]  # what was tightened, and to what: rtol
    status: NDArray[np.uint8]  # uint8[n]: how they ended then
    responses: Mapping[str, Array]  # float64[n]: SI
    # bool[n]: whether a trial was chosen at random, one of each hundred: only these
    # represent the trials that were not evaluated again
    at_random: Truths
    # uint8[n]: by response, why it chose a trial: sums of `Reason`, 0 for none
    chosen_by: Mapping[str, NDArray[np.uint8]] = field(default_factory=dict)
    # some of them, evaluated a third time, tighter still; None if the model cannot
    third: "Audited | None" = None
    # the largest inside steps of trials as the run evaluates them; None if none is
    # integrated step by step
    residual: Residual | None = None

    def response(
        self, name: str, values: Array, permitted: tuple[float, float]
    ) -> AuditedResponse:
        """Return a response beside its values in all trials, SI, NaN in failed ones."""
        third, none = self.third, np.zeros(0)
        reasons = self.chosen_by.get(name, np.zeros(len(self.trials), np.uint8))
        return AuditedResponse(
            values, permitted, self.trials, self.responses[name], self.at_random,
            (reasons & Reason.OUT) > 0,
            np.searchsorted(self.trials, third.trials if third else none),
            third.responses[name] if third else none,
            self.residual.of_rtol if self.residual else 0.0,
        )  # fmt: skip


def differences(
    before: Mapping[str, Any], after: Mapping[str, Any], prefix: str = ""
) -> Iterator[tuple[str, Any, Any]]:
    """Yield the differences of two mappings, also of those in them.

    The name, with a prefix, and both values; None where one has none.
    """
    for name in dict.fromkeys([*before, *after]):
        old, new = before.get(name), after.get(name)
        if isinstance(old, Mapping) and isinstance(new, Mapping):
            yield from differences(old, new, f"{prefix}{name}.")
        elif old != new:
            yield prefix + name, old, new


def joined(first: Audited, second: Audited) -> Audited:
    """Return two sets of trials as one, evaluated with the settings of the first."""
    order = np.argsort(np.concatenate([first.trials, second.trials]))

    def both(a: Any, b: Any) -> Any:
        if isinstance(a, Mapping):
            return {name: both(a[name], b[name]) for name in a}
        return np.concatenate([a, b])[order]

    names = "trials", "status", "responses", "at_random", "chosen_by"
    fields = {n: both(getattr(first, n), getattr(second, n)) for n in names}
    return replace(first, **fields)


class WorstCase(NamedTuple):
    """The worst corner of the tolerances that was found."""

    value: float  # of the response, SI; NaN if every trial failed
    deviations: Mapping[str, float]  # of the trial, SI; empty if the model names none
    tried: int  # trials simulated for it; 0 if the model knows it without
    failed: int  # how many of these failed


class Halved(NamedTuple):
    """The fraction out of limit with some tolerances halved, from weighted trials."""

    beyond: Estimate  # the fraction, or why it cannot be estimated
    effective: int  # effective sample size; 0 without weights


@dataclass(frozen=True)
class Diagnostics:
    """Diagnostics of a run, which follow its trials."""

    # by response and contributor that deviates, at the nominal trial, SI
    slopes: Annotated[
        Mapping[str, Mapping[str, float]],
        Stored(
            axes=("response", "contributor"),
            sentence="slope of each response at the nominal trial, SI",
        ),
    ] = field(default_factory=dict)
    # by limited response and side: "least", "largest"
    worst_cases: Annotated[
        Mapping[str, Mapping[str, WorstCase]],
        Stored(
            axes=("response", "side", "contributor"),
            sentence="worst corner of the tolerances for each end of a limit, SI",
        ),
    ] = field(default_factory=dict)
    # by limited response and the contributors whose tolerances are halved, at once
    halved: Annotated[
        Mapping[str, Mapping[Members, Halved]],
        Stored(
            axes=("response", "contributors"),
            sentence="fraction out of limit with some tolerances halved",
        ),
    ] = field(default_factory=dict)
    # contributors that deviate and change no response
    idle: tuple[str, ...] = ()
    missing: str = ""  # why there are none; empty if there are
