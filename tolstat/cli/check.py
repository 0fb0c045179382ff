"""tolstat check: do runs meet their limits? The exit code says it."""

import sys
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, NamedTuple

import click

from tolstat.answers.report.finding_words import sentences
from tolstat.answers.report.report_warnings import jumping, warnings_of, warnings_of_run
from tolstat.answers.run_entries import judged
from tolstat.answers.sampled_trials import drawn_trials, no_sample
from tolstat.cli import options
from tolstat.cli.entry import LIMITS_NOT_MET, LIMITS_UNDECIDED
from tolstat.errors import Advice, QuestionError, Remedy
from tolstat.render.screen import Screen, as_text
from tolstat.render.serialize import as_json
from tolstat.statistics.limits.yields import NOT_MET, UNDECIDED, Verdict, worded
from tolstat.store.open_run import open as open_run
from tolstat.store.stored_run import Run


class CheckedLimit(NamedTuple):
    """The verdict on a limit of a run."""

    run: str
    response: str
    limit: str  # as written
    verdict: Verdict
    reason: str  # why it is undecided, or on which condition the limit is met


@dataclass(frozen=True)
class LimitCheck:
    """The verdicts on all limits of some runs."""

    limits: tuple[CheckedLimit, ...]
    conditions: tuple[str, ...]  # on which verdicts hold: some reasons of limits
    warnings: tuple[str, ...]  # what a reader has to know before the verdicts
    answers: ClassVar[str] = "check"

    @property
    def exit_code(self) -> int:
        """That of `tolstat check`: of the worst verdict."""
        verdicts = {limit.verdict for limit in self.limits}
        undecided = LIMITS_UNDECIDED if UNDECIDED in verdicts else 0
        return LIMITS_NOT_MET if NOT_MET in verdicts else undecided


@click.command()
@options.path_argument("runs", "RUN.h5...", nargs=-1, required=True)
@click.option("--json", "numbers", is_flag=True, help="The verdicts as JSON.")
def check(runs: tuple[Path, ...], numbers: bool) -> None:
    """Check whether runs meet their limits: a line for each limit.

    The exit code is 0 if all are met, 3 if one is not met, and 4 if one is undecided
    and none is not met. A run without limits is refused with 2.

    A limit that is met on a condition counts as met. Its line says the condition, as
    "met (if the parts are normal)"; JSON lists them all in `conditions`.
    """
    result = checked([open_run(path) for path in runs])
    for warning in result.warnings:
        Screen(stderr=True).say(f"warning: {warning}")
    if numbers:
        click.echo(as_json(result, result.answers), nl=False)
    for run, response, limit, *verdict in () if numbers else result.limits:
        options.say(f"{run}: {response} {limit}: {worded(*verdict)}")
    sys.exit(result.exit_code)


def checked(runs: Iterable[Run]) -> LimitCheck:
    """Return the verdict on each limit of complete runs whose trials are sampled."""
    limits, warnings = list[CheckedLimit](), list[str]()
    for run in runs:
        limits += _limits_of(run)
        warnings += [f"{run.path.name}: {warning}" for warning in _warnings_of(run)]
    decided = (limit.reason for limit in limits if limit.verdict != UNDECIDED)
    conditions = dict.fromkeys(filter(None, decided))
    return LimitCheck(tuple(limits), tuple(conditions), tuple(warnings))


def _warnings_of(run: Run) -> list[str]:
    if sample := drawn_trials(run):
        clusters = jumping(run, sample.trials_done, run.limits)
        warnings = warnings_of(sample, clusters)
    else:
        warnings = warnings_of_run(run)
    return [as_text(parts) for parts in sentences(warnings)]


def require_limits(where: Path, limits: Iterable[str]) -> None:
    """Refuse a run or a study without a limit."""
    if not [*limits]:
        remedy = "no limit to check; write one into [limits] of the study"
        raise QuestionError(f"{where}: {remedy}")


def _limits_of(run: Run) -> list[CheckedLimit]:
    require_limits(run.path, run.limits)
    if not run.complete:
        raise QuestionError(
            f"{run.path}: {run.progress} trials have run; a check needs "
            "all of them and their audit",
            Advice(Remedy.RESUME, run.path, run.machine),
        )
    if not (yields := judged(run)):
        raise no_sample(run)
    aim = f"a rare run searches the limit of {run.aim}"
    return [
        CheckedLimit(
            run.path.name, name, limit.words, judgement.verdict,
            judgement.reason_words
            or aim * (judgement.verdict == UNDECIDED and run.aim not in ("", name)),
        )
        for name, limit in run.limits.items()
        for judgement in [yields[name]]
    ]  # fmt: skip
