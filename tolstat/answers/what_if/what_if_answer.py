"""What a run would have found with other deviations, as types; SI."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

from tolstat.answers.answer import Answer
from tolstat.answers.cells import summary_cells
from tolstat.answers.report.report_answer import AllLimits
from tolstat.document.blocks import Document
from tolstat.document.inline import Number
from tolstat.render.serialize import Row
from tolstat.statistics.summary import Summary
from tolstat.units.scale import Scale


class Change(NamedTuple):
    """How a contributor is distributed.

    Attributes
    ----------
    baseline, scenario : str
        In words.
    fraction_left : float
        Effective sample size with this change alone, as a fraction of the trials.
    """

    baseline: str
    scenario: str
    fraction_left: float


class YieldAllLimits(NamedTuple):
    """The yield of all limits, of the baseline and of the scenario."""

    baseline: AllLimits
    scenario: AllLimits


class ResponseWhatIf(NamedTuple):
    """A response of the run, and of the scenario.

    Attributes
    ----------
    baseline, scenario : Summary
        Of the trials as they are; of the weighted trials.
    nominal : float
        Of the nominal trial.
    sentence : str
        What it is.
    scale : Scale
        How it is shown.
    """

    baseline: Summary
    scenario: Summary
    nominal: float
    sentence: str
    scale: Scale


@dataclass(frozen=True, repr=False)
class WhatIf(Answer):
    """What a run would have found with other deviations.

    Attributes
    ----------
    title, run, model : str
        Of the run.
    changes : dict of str to Change
        By contributor; all others stay, and so do batches and correlations.
    trials, effective_sample_size : int
        Trials that are weighted; how many independent ones they are worth.
    expected_sample_size : float
        The same as the distributions have it, without the trials.
    yield_all_limits : YieldAllLimits or None
        None without limits.
    responses : dict of str to ResponseWhatIf
        All of them.
    notes : tuple of str
        What must be known to read the numbers.
    """

    title: str
    run: str
    model: str
    changes: Mapping[str, Change]
    trials: int
    effective_sample_size: int
    expected_sample_size: float
    yield_all_limits: YieldAllLimits | None
    responses: Mapping[str, ResponseWhatIf]
    notes: tuple[str, ...]
    answers: ClassVar[str] = "what_if"

    @property
    def short(self) -> str:
        """What it is, in a few words."""
        changes = (f"{name} {each.scenario}" for name, each in self.changes.items())
        return f"{self.run}; {'; '.join(changes)}"

    def document(self) -> Document:
        """Return yields, limits and responses of baseline and scenario."""
        from tolstat.answers.what_if.what_if_document import what_if_document

        return what_if_document(self)

    def rows(self) -> Sequence[Row]:
        """Return a row for each response: the scenario, then the baseline."""
        changes = (f"{name}: {each.scenario}" for name, each in self.changes.items())
        scenario = "; ".join(changes)
        return [
            {
                "title": self.title,
                "scenario": scenario,
                "response": name,
                "unit": each.scale.shown,
                "nominal [unit]": Number(each.nominal, each.scale),
                **summary_cells(each.scenario, each.scale),
                **summary_cells(each.baseline, each.scale, "baseline: "),
                "trials": self.trials,
                "effective sample size": self.effective_sample_size,
            }
            for name, each in self.responses.items()
        ]
