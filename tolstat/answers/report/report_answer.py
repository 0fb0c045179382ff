"""The summary, the report and the findings of a run, as types. SI."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

from tolstat.answers.cells import summary_cells
from tolstat.answers.next_steps import Step
from tolstat.answers.remedy.remedy_finding import RemedyFinding
from tolstat.answers.report.report_warnings import NumbersWarning, ReportWarning
from tolstat.answers.report.response_summary import ResponseSummary, by_what_decides
from tolstat.answers.run_answer import RunAnswer
from tolstat.document.inline import Number, Row
from tolstat.statistics import estimate
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.limits.yields import Caveat, PartsUncertainty, Verdict
from tolstat.statistics.summary import Limited
from tolstat.units.scale import Scale


class NoCause(StrEnum):
    """Why no contributor is named as a cause."""

    NONE_OUT = "no trial out of limit"
    NONE_OUT_AT_RANDOM = "no random trial out of limit"  # thinned ones may be
    MOST_OUT = "not named: most trials are out of limit"
    NOT_SIGNIFICANT = "no significant difference"
    RANDOM_ONLY = str(estimate.RANDOM_ONLY)
    JUMPS = "the response jumps"
    INTEGRATION_ERROR = Caveat.INTEGRATION_ERROR.value
    FAILED_AGAIN = Caveat.FAILED_AGAIN.value
    FEW_PARTS = "number of measured parts"


# none of the contributors is to be changed for these reasons
NOT_BY_TOLERANCES = (
    NoCause.JUMPS, NoCause.INTEGRATION_ERROR, NoCause.FAILED_AGAIN, NoCause.FEW_PARTS,
)  # fmt: skip


class LimitFinding(NamedTuple):
    """What is decided about a limit."""

    verdict: Verdict
    reason: Caveat  # why it is undecided, or on which condition it is met
    trials_that_decide: int = 0  # 0 if it is decided, or no number decides
    seems_missed: bool = False  # whether more trials are out of it than permitted
    causes: tuple[tuple[str, ...], ...] = ()  # contributors, the main cause first
    no_cause: str = ""  # why none is named
    trials_that_tell: int = 0  # of causes, where these are too few
    # contributor or kind of part with the largest share of the variance, where no
    # cause is named
    largest_contribution: str = ""
    # where few measured parts leave it undecided: how far
    measured: PartsUncertainty | None = None


class Findings(NamedTuple):
    """What is decided about a run, the most important first."""

    limits: Mapping[str, LimitFinding]
    remedy: RemedyFinding | None  # None where all is met, or nothing is known
    steps: tuple[Step, ...]

    def cells(self, response: str) -> dict[str, str | int]:
        """Return cells of a wide table: what is decided about a response."""
        limit = self.limits.get(response)
        about = [s for s in self.steps if response in s.responses or not s.responses]
        remedy = (limit and self.remedy) or RemedyFinding()
        entries = (f"{name}={entry}" for name, entry in remedy.entries.items())
        return {
            "main causes": "; ".join(map(", ".join, limit.causes)) if limit else "",
            "no cause": str(limit.no_cause) if limit else "",
            "trials that decide": limit.trials_that_decide if limit else 0,
            "next steps": "; ".join(step.kind for step in about),
            "commands": "; ".join(c.text for step in about for c in step.commands),
            "remedy": "; ".join(entries) or remedy.reason,
            "remedy proved by trials": remedy.trials,
        }


class UnseenErrors(NamedTuple):
    """What an audit cannot see: errors of the trials that were not evaluated again."""

    evaluated: int  # random trials, again
    moved: int  # of these
    share: Estimate  # of all trials that move


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
    unseen_errors: UnseenErrors | None  # None where no verdict rests on an audit
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
        numbers = [x for x in self.warnings if isinstance(x, NumbersWarning)]
        limits = self.limits
        return [x for x in numbers if limits and x.response not in limits]

    @property
    def verdicts(self) -> dict[str, str]:
        """The verdict of each limited response, in the order of responses."""
        limits = {n: x.limited for n, x in self.responses.items() if x.limited}
        return {name: limited.yields.verdict for name, limited in limits.items()}

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
                **self.findings.cells(name),
            }
            for name, response in self.responses.items()
        ]
