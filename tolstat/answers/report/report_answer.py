"""The summary and the report of a run, as types. SI."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from tolstat.answers.cells import summary_cells
from tolstat.answers.report.findings import Findings
from tolstat.answers.report.report_warnings import NumbersWarning, ReportWarning
from tolstat.answers.report.response_summary import (
    ReportedResponse,
    ResponseSummary,
    by_what_decides,
)
from tolstat.answers.run_answer import RunAnswer
from tolstat.document.inline import Number
from tolstat.render.serialize import Row
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.summary import Limited
from tolstat.units.scale import Scale


class AllLimits(NamedTuple):
    """All limits together."""

    limits: int
    within: Estimate  # yield: fraction within all of them at once
    # greatest chance that one or more verdicts is wrongly "met", of independent trials
    wrongly_met: float


class NumberOfStudy(NamedTuple):
    """A number of the study, SI, and how it is shown."""

    value: float
    scale: Scale
    sentence: str
    caveat: str


@dataclass(frozen=True, repr=False)
class RunSummary(RunAnswer):
    """The summary at the end of a run."""

    # what a reader has to know before any verdict
    warnings: tuple[ReportWarning, ...]
    # what the audit cannot see, where verdicts rest on one; else empty
    unseen_errors: str
    all_limits: AllLimits | None  # None without limits
    responses: Mapping[str, ResponseSummary]
    numbers: Mapping[str, NumberOfStudy]  # equal for all its trials
    findings: Findings  # of its limits: why a verdict, and what to do next
    answers = "summary"

    @property
    def limits(self) -> dict[str, Limited]:
        """The limited responses by what decides; see `by_what_decides`."""
        return by_what_decides(self.responses)

    @property
    def early_warnings(self) -> list[ReportWarning]:
        """The warnings that stand before the verdicts."""
        late = self.late_warnings
        return [warning for warning in self.warnings if warning not in late]

    @property
    def late_warnings(self) -> list[ReportWarning]:
        """The warnings about numbers of responses that no verdict rests on."""
        limits = self.limits
        return [
            warning
            for warning in self.warnings
            if limits
            and isinstance(warning, NumbersWarning)
            and warning.response not in limits
        ]

    @property
    def verdicts(self) -> dict[str, str]:
        """The verdict of each limited response, in the order of responses."""
        limits = self.limits
        return {n: limits[n].yields.verdict for n in self.responses if n in limits}

    @property
    def _short(self) -> str:
        limits = self.limits
        verdicts = (f"{n} {limits[n].yields.words}" for n in self.verdicts)
        return f"{self.run}, {self.trials.done} trials; {', '.join(verdicts) or '-'}"

    def rows(self) -> Sequence[Row]:
        """Return a row for each response."""
        return [
            {
                "title": self.title,
                "response": name,
                "unit": response.scale.shown,
                "nominal [unit]": Number(response.nominal, response.scale),
                **summary_cells(response, response.scale),
                "trials done": self.trials.done,
                "trials failed": self.trials.failed,
            }
            for name, response in self.responses.items()
        ]


@dataclass(frozen=True, repr=False)
class Report(RunSummary):
    """The statistical tolerance report of a run."""

    responses: Mapping[str, ReportedResponse]
    focus: tuple[str, ...]  # responses in focus
    answers = "report"
