"""The answer about a run of given trials: extremes, and trials out of limit."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar, NamedTuple

import numpy as np

from tolstat.answers.answer import Answer
from tolstat.answers.run_answer import notes_of
from tolstat.answers.sweep.extremes_document import extremes_document
from tolstat.document.blocks import Document
from tolstat.document.inline import Number
from tolstat.render.serialize import Row
from tolstat.statistics.limits.limit import Limit
from tolstat.status import Status
from tolstat.store.stored_run import ROUNDING, Run
from tolstat.units.scale import Scale


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


@dataclass(frozen=True, repr=False)
class Extremes(Answer):
    """Extremes of a grid or a table, whose trials are no sample of production."""

    title: str
    run: str
    model: str
    sampling: str
    trials: int
    ran: int
    failed: int
    responses: Mapping[str, ResponseExtremes]
    notes: tuple[str, ...]  # for readers of the numbers
    stored_run: Run = field(metadata={"json": False})
    answers: ClassVar[str] = "extremes"

    @property
    def short(self) -> str:
        """A description in a few words."""
        return f"{self.run}, {self.ran} trials of a {self.sampling}"

    def document(self) -> Document:
        """Return responses, limits, the trials of a table, the reference of a grid."""
        return extremes_document(self)

    def rows(self) -> Sequence[Row]:
        """Return a row for each response."""
        return [
            {
                "title": self.title,
                "response": name,
                "unit": each.scale.shown,
                "nominal [unit]": Number(each.nominal, each.scale),
                "least [unit]": _value(each.least, each.scale),
                "largest [unit]": _value(each.largest, each.scale),
                "trials out of limit": each.trials_out_of_limit,
            }
            for name, each in self.responses.items()
        ]


def _value(extreme: Extreme | None, scale: Scale) -> Number:
    return Number(extreme.value if extreme else math.nan, scale)


def extremes_of(run: Run) -> Extremes:
    """Return the extremes of a run whose trials are given and not sampled."""
    responses = {}
    for name in (each.name for each in run.responses):
        limit = run.limits.get(name)
        out = int(np.count_nonzero(run.beyond(name))) if limit else 0
        nominal, ends = run.nominal_values[name], _ends(run, name)
        responses[name] = ResponseExtremes(nominal, run.scales[name], *ends, limit, out)
    return Extremes(
        run.title, run.path.name, run.model, run.sampling, run.trials, run.ended,
        run.failed, responses, tuple(notes_of(run, None)), run,
    )  # fmt: skip


def _ends(run: Run, name: str) -> tuple[Extreme | None, Extreme | None]:
    """Return the least and the largest value, each with its trial."""
    done = np.flatnonzero(run.status == Status.DONE)
    if not len(done):
        return None, None
    values = run.column(name)[done]
    if np.ptp(values) <= ROUNDING * np.abs(values).max():
        same = Extreme(float(values[0]), None)
        return same, same
    least, largest = (
        Extreme(float(values[i]), int(done[i]))
        for i in (values.argmin(), values.argmax())
    )
    return least, largest
