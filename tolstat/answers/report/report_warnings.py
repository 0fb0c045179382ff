"""Warnings of a report: what a reader has to know before any verdict."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from tolstat.answers.sampled_trials import Drawn
from tolstat.arrays import Array, Integers
from tolstat.execution.compatibility import edits_since
from tolstat.statistics.clusters import NO_TURNS, Clusters, clusters_of
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.integration_error import Movement
from tolstat.statistics.limits.yields import MET, Caveat, PartsUncertainty
from tolstat.statistics.summary import Limited
from tolstat.store.run_records import Residual
from tolstat.store.stored_run import Run
from tolstat.units.scale import Scale

# times the largest size of a response in all trials, and parts of the least: ends of
# limits beyond are of another order of magnitude
FAR_ABOVE, FAR_BELOW = 10.0, 0.01
# by SI unit of a response: its steps that are turns, and the fewest trials a turn away
# that are named; atan and the axis of a body jump by half a turn, and a plain number
# may be an angle
TURNS = {
    "rad": ({2 * math.pi: 1.0, math.pi: 0.5}, 1),
    "1": ({2 * math.pi: 1.0, 360.0: 1.0}, 5),
}


class StudyWarning(NamedTuple):
    """A warning of the study or of its model, known before any trial ran.

    Or of a study that was edited since.
    """

    sentence: str
    kind: str = "study"


class JumpWarning(NamedTuple):
    """A response whose trials fall into two clusters a step apart."""

    response: str
    clusters: Clusters
    scale: Scale
    kind: str = "jump"


class VerdictWarning(NamedTuple):
    """A verdict that the audit leaves undecided."""

    response: str
    movement: Movement
    scale: Scale
    reason: Caveat
    kind: str = "verdict"


class WrongNumber(NamedTuple):
    """A number that errs by more than its interval."""

    number: Estimate
    error: float  # by the trials evaluated again: the number less its right value


class NumbersWarning(NamedTuple):
    """Numbers of a response whose integration errors exceed their intervals."""

    response: str
    numbers: Mapping[str, WrongNumber]
    scale: Scale
    kind: str = "numbers"


class VisibleError(NamedTuple):
    """The largest integration error of a response, SI, of its sigma, and its scale."""

    error: float
    of_sigma: float
    scale: Scale


class ErrorsWarning(NamedTuple):
    """Responses with integration errors above a tenth of sigma, the largest first."""

    responses: Mapping[str, VisibleError]
    kind: str = "errors"


class GrowthWarning(NamedTuple):
    """Responses that at least double with each evaluation at shorter steps."""

    responses: tuple[str, ...]
    kind: str = "growth"


class StepsWarning(NamedTuple):
    """Rates that bend or jump inside steps of trials."""

    residual: Residual
    kind: str = "steps"


class IdleContributors(NamedTuple):
    """Contributors that deviate and change no response."""

    contributors: tuple[str, ...]
    kind: str = "idle contributors"


class UnchangedResponse(NamedTuple):
    """A limited response that no deviation changes."""

    response: str
    value: float  # of all its trials, SI
    scale: Scale
    kind: str = "unchanged response"


class FarLimit(NamedTuple):
    """A limit of another order of magnitude than all trials, as of a wrong unit."""

    response: str
    end: float  # SI, as the trials
    smallest: float
    largest: float
    scale: Scale
    kind: str = "far limit"


class PartsWarning(NamedTuple):
    """A limit that few measured parts leave undecided."""

    response: str
    share: PartsUncertainty
    kind: str = "measured parts"


class AllPartsWarning(NamedTuple):
    """Numbers that take the measured parts as all there are."""

    entries: Mapping[str, int]  # measured parts, by entry
    kind: str = "all measured parts"


class UnusualParts(NamedTuple):
    """What is unusual in measured parts: two kinds, a cut tail, a trend, lots."""

    entry: str
    finding: Any  # of `JudgedParts`, which few runs load
    scale: Scale
    kind: str = "unusual parts"


ReportWarning = (
    StudyWarning
    | UnusualParts
    | PartsWarning
    | AllPartsWarning
    | IdleContributors
    | UnchangedResponse
    | FarLimit
    | JumpWarning
    | VerdictWarning
    | NumbersWarning
    | ErrorsWarning
    | GrowthWarning
    | StepsWarning
)


def decided_by_errors(
    limits: Mapping[str, Limited], warnings: Iterable[ReportWarning]
) -> list[str]:
    """Return the limited responses that integration errors decide.

    Their verdict is undecided by errors, or by trials that fail when evaluated again;
    or the limit is not met and errors exceed an interval or a tenth of
    sigma. No tolerance explains these.
    """
    visible = set[str]()
    for warning in warnings:
        if isinstance(warning, NumbersWarning):
            visible.add(warning.response)
        elif isinstance(warning, ErrorsWarning):
            visible |= {*warning.responses}
    return [
        name
        for name, limited in limits.items()
        if limited.yields.reason in Caveat.of_audit()
        or (limited.yields.verdict != MET and name in visible)
    ]


def jumping(
    run: Run, trials: Integers, responses: Iterable[str]
) -> dict[str, Clusters]:
    """Return the clusters of responses that jump, by response.

    `trials` are done; of a rare run those of any stage.
    """
    names = list(run.assumed)

    def rows(chosen: Integers) -> Array:
        parts = [run.column(name)[trials[chosen]] for name in names]
        return np.stack(parts, axis=1) if parts else np.empty((len(chosen), 0))

    clusters = {
        name: clusters_of(
            run.column(name)[trials], rows, *TURNS.get(run.units[name], (NO_TURNS,))
        )
        for name in responses
    }
    return {name: parted for name, parted in clusters.items() if parted}


def turning(run: Run, trials: Integers) -> list[str]:
    """Return the limited responses that jump as an angle: they have no verdict."""
    clusters = jumping(run, trials, run.limits)
    return [name for name, parted in clusters.items() if parted.turn]


def warnings_of(
    drawn: Drawn, clusters: Mapping[str, Clusters], *, unsettled: bool = False
) -> tuple[ReportWarning, ...]:
    """Return the warnings about a run whose trials were sampled.

    `clusters` are those of `jumping`. Where integration errors leave a verdict
    `unsettled`, they may as well be why a contributor changes nothing.
    """
    run = drawn.run
    unusual = (
        UnusualParts(name, finding, part.scale)
        for name, part in drawn.judged_parts.items()
        for finding in part.unusual
    )
    if unsettled:
        return (*_of_study(run), *unusual)
    return (
        *warnings_of_run(run),
        *unusual,
        *(
            UnchangedResponse(name, float(drawn.done(name)[0]), run.scales[name])
            for name in run.limits
            if _unchanged(drawn, name)
        ),
        *_far_limits(drawn),
        *(JumpWarning(name, x, run.scales[name]) for name, x in clusters.items()),
        *_of_measured_parts(drawn),
    )


def _far_limits(drawn: Drawn) -> Iterator[FarLimit]:
    """Yield ends of limits of another order of magnitude than all trials.

    Where no contributor of this kind is written in their unit: what a chain answers is
    in the unit of its links. Where trials are rows of a file, its units may be wrong.
    """
    run = drawn.run
    for response in run.responses:
        name, limit = response.name, run.limits.get(response.name)
        alike = (p.name for p in run.contributors if p.unit == response.unit != "1")
        units = {run.scales[part].shown for part in alike}
        if limit is None:
            continue
        if not run.listed and (not units or _typed_in(limit.words, units)):
            continue
        done = drawn.done(name)
        sizes, ends = np.abs(done), limit.asked if done.any() else ()
        if not any(
            FAR_BELOW * sizes.min() < abs(end) < FAR_ABOVE * sizes.max() for end in ends
        ):
            for end in ends:
                reach = float(done.min()), float(done.max())
                yield FarLimit(name, end, *reach, run.scales[name])


def _typed_in(words: str, units: Iterable[str]) -> bool:
    return any(re.search(rf"[\d. ]{re.escape(unit)}$", words) for unit in units)


def _of_measured_parts(drawn: Drawn) -> Iterator[PartsWarning | AllPartsWarning]:
    """Yield what few measured parts leave undecided; too few of all limits at once."""
    run = drawn.run
    if run.aim and run.measured:
        yield AllPartsWarning({sample.name: sample.parts for sample in run.measured})
    for name, limit in run.limits.items():
        if (share := drawn.uncertainty(name)) is None:
            continue
        permitted, (lower, upper) = 1 - limit.demanded, share.interval[1:3]
        if not (lower > permitted or upper <= permitted):
            yield PartsWarning(name, share)
            if not share.interval.sure:
                return


def _of_study(run: Run) -> Iterator[StudyWarning]:
    return map(StudyWarning, [*edits_since(run), *run.warnings])


def warnings_of_run(run: Run) -> tuple[ReportWarning, ...]:
    """Return the warnings about any run, whatever its sampling."""
    named = " ".join(run.warnings)  # by the model, which knows why they are idle
    idle = [n for n in run.diagnostics.idle if not re.search(rf"\b{n}\b", named)]
    return (*_of_study(run), *([IdleContributors(tuple(idle))] if idle else []))


def _unchanged(drawn: Drawn, name: str) -> bool:
    """Return whether all trials of a response are equal, its worst cases too.

    A response at zero or at an end of its range, as a share of time, may well stay
    there: then only if no deviation changes any response.
    """
    done, diagnostics = drawn.done(name), drawn.run.diagnostics
    if len(done) < 2 or done.min() < done.max():
        return False
    value = float(done[0])
    worst_cases = diagnostics.worst_cases.get(name, {}).values()
    slopes = diagnostics.slopes.get(name, {})
    if any(slopes.values()) or any(case.value != value for case in worst_cases):
        return False
    (response,) = (x for x in drawn.run.responses if x.name == name)
    at_an_end = value in (0.0, *(response.range or ()))
    return not at_an_end or {*slopes} <= {*diagnostics.idle}
