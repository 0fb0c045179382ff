"""The answer about a run of given trials: extremes, and trials out of limit."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from tolstat.answers.next_steps import Step, StepKind, with_commands
from tolstat.answers.report.report_answer import Findings
from tolstat.answers.report.report_warnings import ReportWarning, warnings_of_run
from tolstat.answers.run_answer import (
    AboutRun,
    identity_of,
    notes_of,
    responses_in_focus,
)
from tolstat.answers.sweep.curves import point_words
from tolstat.document.inline import Number, Row
from tolstat.statistics.limits.limit import Limit, margins
from tolstat.status import Status
from tolstat.store.stored_run import ROUNDING, Run
from tolstat.units.scale import Scale

TINY = 1e-300  # instead of 0, to divide by


class Extreme(NamedTuple):
    """A value, SI, and its trial; None where all trials have the same value."""

    value: float
    trial: int | None


class ResponseExtremes(NamedTuple):
    """A response over the trials that are done."""

    nominal: float  # of the nominal trial; NaN if that failed
    scale: Scale
    least: Extreme | None  # None where no trial is done
    largest: Extreme | None
    limit: Limit | None  # the permitted range
    trials_out_of_limit: int  # trials, failed ones among them; 0 without a limit


class Point(NamedTuple):
    """A trial, and the limit that decides it: the one met by least, or missed most.

    Limits compare by the distance to their nearer end, over the largest of all trials.
    """

    trial: int
    at: str  # its place in the grid
    response: str
    value: float  # of that response, SI


@dataclass(frozen=True, repr=False)
class Extremes(AboutRun):
    """Extremes of a grid or a table, whose trials are no sample of production."""

    sampling: str
    trials: int
    ran: int
    failed: int
    responses: Mapping[str, ResponseExtremes]
    meet_all: int  # trials within all limits
    best: Point | None  # None without a limit, and where no trial is done
    worst: Point | None
    focus: tuple[str, ...]  # responses that the page draws
    findings: Findings  # what to do next
    # what a reader has to know before all numbers
    warnings: tuple[ReportWarning, ...]
    notes: tuple[str, ...]  # for readers of the numbers
    answers = "extremes"

    @property
    def _short(self) -> str:
        return f"{self.run}, {self.ran} trials of a {self.sampling}"

    def rows(self) -> Sequence[Row]:
        """Return a row for each response."""
        return [
            {
                "title": self.title,
                "response": name,
                "unit": response.scale.shown,
                "nominal [unit]": Number(response.nominal, response.scale),
                "least [unit]": _value(response.least, response.scale),
                "largest [unit]": _value(response.largest, response.scale),
                "trials out of limit": response.trials_out_of_limit,
            }
            for name, response in self.responses.items()
        ]


def _value(extreme: Extreme | None, scale: Scale) -> Number:
    return Number(extreme.value if extreme else math.nan, scale)


def extremes_of(run: Run, chosen: Sequence[str] = ()) -> Extremes:
    """Return the extremes of a run whose trials are given and not sampled.

    `chosen`: the responses that its page draws; by default the one that decides.
    """
    out_of_limit = {name: run.beyond(name) for name in run.limits}
    out_of_any = np.any([run.status != Status.DONE, *out_of_limit.values()], axis=0)
    responses = {
        name: ResponseExtremes(
            run.nominal_values[name], run.scales[name], *_ends(run, name),
            run.limits.get(name), int(np.count_nonzero(out_of_limit.get(name, ()))),
        )
        for name in (response.name for response in run.responses)
    }  # fmt: skip
    best, worst = _best_and_worst(run)
    by_default = [worst.response] if worst else responses_in_focus(run)[:1]
    focus = responses_in_focus(run, chosen) if chosen else by_default
    return Extremes(
        **identity_of(run), sampling=run.sampling, trials=run.trials, ran=run.ended,
        failed=run.failed, responses=responses,
        meet_all=int(np.count_nonzero(~out_of_any)), best=best, worst=worst,
        focus=tuple(focus),
        findings=Findings({}, None, with_commands(run, _next_steps(run, worst, focus))),
        warnings=warnings_of_run(run),
        notes=tuple(notes_of(replace(run, warnings=()), None)),
    )  # fmt: skip


def _next_steps(run: Run, worst: Point | None, focus: Sequence[str]) -> Iterator[Step]:
    """Yield the next steps: run the rest; or simulate the worst trial, see all."""
    if not run.complete:
        yield Step(StepKind.RESUME)
        return
    if worst:
        yield Step(StepKind.SEE_WORST, (worst.response,), trial=worst.trial)
    names = (response.name for response in run.responses)
    if other := next((name for name in names if name not in focus), ""):
        yield Step(StepKind.DRAW_RESPONSE, (other,))
    yield Step(StepKind.WRITE_TABLE)


def _best_and_worst(run: Run) -> tuple[Point | None, Point | None]:
    """Return the trials farthest within all limits, and farthest out of one."""
    done, names = np.flatnonzero(run.status == Status.DONE), list(run.limits)
    if not len(done) or not names:
        return None, None
    within = np.array([
        margins(run.column(name)[done], run.limits[name].permitted) for name in names
    ])  # fmt: skip
    within /= np.maximum(np.abs(within).max(axis=1, keepdims=True), TINY)
    least, by = within.min(axis=0), within.argmin(axis=0)
    best, worst = (
        Point(trial, point_words(run, trial), name, float(run.column(name)[trial]))
        for i in (least.argmax(), least.argmin())
        for trial, name in [(int(done[i]), names[by[i]])]
    )
    return best, worst


def _ends(run: Run, name: str) -> tuple[Extreme | None, Extreme | None]:
    """Return the least and the largest value, each with its trial."""
    done = np.flatnonzero(run.status == Status.DONE)
    if not len(done):
        return None, None
    values = run.column(name)[done]
    if np.ptp(values) <= ROUNDING * np.abs(values).max():
        same = Extreme(float(values[0]), None)
        return same, same
    ends = values.argmin(), values.argmax()
    least, largest = (Extreme(float(values[i]), int(done[i])) for i in ends)
    return least, largest
