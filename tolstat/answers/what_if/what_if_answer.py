"""The answer of a what-if: results of a run with other deviations."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from tolstat.answers.answer import Answer
from tolstat.answers.cells import summary_cells
from tolstat.answers.report.report_answer import AllLimits
from tolstat.document.inline import Number, Row
from tolstat.statistics.summary import Summary
from tolstat.units.scale import Scale


class Change(NamedTuple):
    """How a contributor is distributed."""

    baseline: str  # in words
    scenario: str
    fraction_left: float  # effective sample size with this change alone, per trial


class AllLimitsWhatIf(NamedTuple):
    """The yield of all limits, of the baseline and of the scenario."""

    baseline: AllLimits
    scenario: AllLimits


class ResponseWhatIf(NamedTuple):
    """A response of the run, and of the scenario."""

    baseline: Summary  # of the trials as they are
    scenario: Summary  # of the weighted trials
    nominal: float  # of the nominal trial
    sentence: str  # its description
    scale: Scale
    # effective sample size of the weighted out-of-limit trials; None without a limit
    out_of_limit_sample_size: int | None


@dataclass(frozen=True, repr=False)
class WhatIf(Answer):
    """Results of a run with other deviations."""

    title: str  # of the run
    run: str
    model: str
    # by contributor; all others stay, and so do batches and correlations
    changes: Mapping[str, Change]
    trials: int  # that are weighted
    # of the weighted trials; at most the expected one
    effective_sample_size: int
    expected_sample_size: float  # the same by the distributions, without the trials
    all_limits: AllLimitsWhatIf | None  # None without limits
    responses: Mapping[str, ResponseWhatIf]
    notes: tuple[str, ...]  # for readers of the numbers
    answers = "what_if"

    @property
    def _short(self) -> str:
        return f"{self.run}; {self._scenario}"

    def rows(self) -> Sequence[Row]:
        """Return a row for each response: the scenario, then the baseline."""
        return [
            {
                "title": self.title,
                "scenario": self._scenario,
                "response": name,
                "unit": response.scale.shown,
                "nominal [unit]": Number(response.nominal, response.scale),
                **summary_cells(response.scenario, response.scale),
                **summary_cells(response.baseline, response.scale, "baseline: "),
                "trials": self.trials,
                "effective sample size": self.effective_sample_size,
                "effective sample size, out of limit": ""
                if response.out_of_limit_sample_size is None
                else response.out_of_limit_sample_size,
            }
            for name, response in self.responses.items()
        ]

    @property
    def _scenario(self) -> str:
        return "; ".join(f"{name}: {x.scenario}" for name, x in self.changes.items())
