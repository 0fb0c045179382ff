"""The answer of a what-if: results of a run with other deviations."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import NamedTuple

from tolstat.answers.answer import Answer
from tolstat.answers.cells import NONE, summary_cells
from tolstat.answers.compare.comparison import ResponseDifference
from tolstat.answers.compare.pairing import NOT_IN_JSON
from tolstat.answers.report.report_answer import AllLimits
from tolstat.answers.sampled_trials import Drawn
from tolstat.document.inline import Number, Row
from tolstat.statistics.summary import Summary
from tolstat.units.scale import PPM, Scale


class Method(StrEnum):
    """Where the trials of a scenario come from."""

    EVALUATED = "evaluated"  # with the seed of the run
    REWEIGHTED = "reweighted"  # the stored ones, by the ratio of densities
    STORED = "stored"  # as they are: limits change alone


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
    # scenario less baseline, trial by trial, of evaluated trials; None of others
    difference: ResponseDifference | None = None


@dataclass(frozen=True, repr=False)
class WhatIf(Answer):
    """Results of a run with other deviations."""

    title: str  # of the run
    run: str
    model: str
    method: Method
    # by contributor; all others stay, and so do batches and correlations
    changes: Mapping[str, Change]
    trials: int  # of the scenario
    # of weighted trials at most the expected one; of others their number
    effective_sample_size: int
    expected_sample_size: float  # the same by the distributions, without the trials
    all_limits: AllLimitsWhatIf | None  # None without limits
    responses: Mapping[str, ResponseWhatIf]
    notes: tuple[str, ...]  # for readers of the numbers
    baseline: Drawn = field(metadata=NOT_IN_JSON)
    scenario: Drawn = field(metadata=NOT_IN_JSON)
    answers = "what_if"

    @property
    def _short(self) -> str:
        return f"{self.run}; {self.words}"

    def rows(self) -> Sequence[Row]:
        """Return a row for each response: the scenario, then the baseline."""
        return [
            {
                "title": self.title,
                "scenario": self.words,
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
                **_difference_cells(response),
            }
            for name, response in self.responses.items()
        ]

    @property
    def words(self) -> str:
        """The scenario: what changes, or else its limits that do."""
        changes = [f"{name}: {x.scenario}" for name, x in self.changes.items()]
        limits = [
            f"{name} {x.scenario.limited.limit.words}"
            for name, x in self.responses.items()
            if x.scenario.limited
            and x.scenario.limited.limit != getattr(x.baseline.limited, "limit", None)
        ]
        return "; ".join(changes or limits) or "no change"


def _difference_cells(response: ResponseWhatIf) -> Row:
    """Return the paired differences of a response, scenario less baseline."""
    less, scale = response.difference, response.scale
    limit = less.limit if less and less.limit else None
    share = limit.fraction_out_of_limit_difference if limit else NONE
    ppk = limit.equivalent_ppk_difference if limit else NONE
    return {
        "difference: mean [unit]": Number(less.mean if less else NONE, scale),
        "difference: fraction out of limit [ppm]": Number(share, PPM),
        "difference: equivalent Ppk": Number(ppk),
    }


@dataclass(frozen=True, repr=False)
class Scenarios(Answer):
    """Several scenarios of a run, side by side."""

    title: str  # of the run
    run: str
    model: str
    scenarios: tuple[WhatIf, ...]
    answers = "scenarios"

    @property
    def _short(self) -> str:
        return f"{self.run}; {' | '.join(x.words for x in self.scenarios)}"

    def rows(self) -> Sequence[Row]:
        """Return the rows of each scenario."""
        return [row for scenario in self.scenarios for row in scenario.rows()]
