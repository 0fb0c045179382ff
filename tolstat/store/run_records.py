"""Records of a run: its study, its settings, its results at the end."""

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import IntFlag
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.arrays import Array, Truths
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.integration_error import AuditedResponse

SCORES = np.linspace(-8.0, 8.0, 513)  # normal scores; hardly a part lies outside
Members = tuple[str, ...]  # contributors, taken together


@dataclass(frozen=True)
class StudyText:
    """The study that a run was made from: its text, as it was written."""

    text: str

    @cached_property
    def table(self) -> dict[str, Any]:
        """The text, read as TOML."""
        return tomllib.loads(self.text)

    @property
    def trials(self) -> int | None:
        """Number of trials requested; None with a stopping rule or without one."""
        trials = self.table.get("trials")
        return trials if isinstance(trials, int) else None

    @property
    def seed(self) -> int | None:
        """Its seed; None where it has none."""
        return self.table.get("seed")


class Assumed(NamedTuple):
    """Assumptions on a deviation."""

    tolerance: tuple[float, float]  # its ends, SI
    words: str  # its distribution
    batch: str  # the batch whose parts all have this deviation; empty without one
    mean: float = math.nan  # of its distribution, SI
    sigma: float = math.nan  # of its distribution, SI
    # deviations at the normal scores of `SCORES`, SI, ascending; of rare runs, empty
    # in others
    at_scores: tuple[float, ...] = ()


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

    seed: int  # from which all random numbers come
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


class Stopped(NamedTuple):
    """How a stopping rule ended a run."""

    rules: tuple[str, ...]  # as they are written: `Run.rules`
    reached: bool  # whether all of them were met
    stages: tuple[int, ...]  # numbers of trials at which they were evaluated
    at_most: int  # most trials allowed
    # trials that the rule needed at its last look: 0 if it was met, infinite if there
    # was no interval yet
    wanted: float = 0.0


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
        )  # fmt: skip


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
    slopes: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    # by limited response and side: "least", "largest"
    worst_cases: Mapping[str, Mapping[str, WorstCase]] = field(default_factory=dict)
    # by limited response and the contributors whose tolerances are halved, at once
    halved: Mapping[str, Mapping[Members, Halved]] = field(default_factory=dict)
    # contributors that deviate and change no response
    idle: tuple[str, ...] = ()
    missing: str = ""  # why there are none; empty if there are
