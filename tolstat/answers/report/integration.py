"""Integration errors, from the trials of a run that were evaluated again."""

import math
from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from tolstat.answers.report.report_answer import UnseenErrors
from tolstat.answers.report.report_warnings import (
    ErrorsWarning,
    GrowthWarning,
    NumbersWarning,
    ReportWarning,
    StepsWarning,
    VerdictWarning,
    VisibleError,
    WrongNumber,
)
from tolstat.answers.report.response_summary import (
    Effect,
    IntegrationErrors,
    LargestError,
    by_name,
)
from tolstat.answers.sampled_trials import Drawn, changes_of
from tolstat.arrays import Array
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.integration_error import (
    VISIBLE,
    IntegrationError,
    integration_error,
    share_above_largest,
)
from tolstat.statistics.intervals.shares import proportion
from tolstat.statistics.limits.yields import UNDECIDED, Caveat, yield_of
from tolstat.statistics.sample import quantiles_at
from tolstat.statistics.summary import Summary
from tolstat.status import Status
from tolstat.store.run_records import Audited, Reason
from tolstat.store.stored_run import Run

ROUNDING = 1e-10  # of a response: sums of thousands of steps


def integration_of(
    drawn: Drawn, name: str, summary: Summary
) -> IntegrationErrors | None:
    """Return the integration errors of a response, and their effect on its numbers.

    None where nothing was evaluated again, and of a residual.
    """
    run = drawn.run
    if (audited := run.audit_of(name)) is None:
        return None
    random, reasons = audited.at_random, _reasons(audited, name)
    error = _errors(run, audited, name)

    def largest(chosen: NDArray[np.bool_]) -> LargestError:
        errors = error.selected(audited.trials[chosen])
        return LargestError(len(errors.trials), errors.largest)

    # statements about production need independent trials
    at_random = largest(random & np.isin(audited.trials, drawn.trials))
    flags = {str(r.name).lower(): (reasons & r) > 0 for r in Reason}
    above = share_above_largest(at_random.trials)
    return IntegrationErrors(
        len(audited.trials),
        error.failed,
        audited.settings,
        error.largest,
        at_random,
        above=math.nan if drawn.sample.replicates else above,
        chosen={why: largest(trials) for why, trials in flags.items() if trials.any()},
        effect=_effect(drawn, error, name, summary) if len(error.trials) else None,
        changed=int(np.count_nonzero(changes_of(run, name)))
        if summary.limited
        else None,
    )


def integration_warnings(
    drawn: Drawn, summaries: Mapping[str, Summary]
) -> Iterator[ReportWarning]:
    """Yield what steps jumped over, what grows, undecided verdicts, spoiled numbers.

    Then the other responses whose errors are visible. None of residuals, and none of
    weighted trials, whose errors are not weighted.
    """
    if drawn.run.audited is None or drawn.sample.weights:
        return
    summaries = {n: x for n, x in summaries.items() if drawn.run.audit_of(n)}
    residual = drawn.run.audited.residual
    if residual and residual.kinked:
        yield StepsWarning(residual)
    growing = [n for n in summaries if (x := drawn.audited(n)) and x.grows]
    if growing:
        yield GrowthWarning(tuple(growing))
    settling = {n: x for n, x in summaries.items() if n not in growing}
    visible = _visible_errors(drawn, drawn.run.audited, settling)
    for name, summary in summaries.items():
        scale, audited = drawn.run.scales[name], drawn.audited(name)
        limited = summary.limited
        reason = limited.yields.reason if limited else Caveat.NONE
        if audited and reason in Caveat.of_audit():
            visible.pop(name, None)
            yield VerdictWarning(name, audited.movement, scale, reason)
    for name, summary in settling.items():
        if wrong := _wrong_numbers(drawn, drawn.run.audited, name, summary):
            visible.pop(name, None)
            yield NumbersWarning(name, wrong, drawn.run.scales[name])
    if visible:
        yield ErrorsWarning(visible)


def _visible_errors(
    drawn: Drawn, audited: Audited, summaries: Mapping[str, Summary]
) -> dict[str, VisibleError]:
    """Return the largest errors of responses above a tenth of sigma, largest first."""
    visible = dict[str, VisibleError]()
    for name, summary in summaries.items():
        error, sigma = _errors(drawn.run, audited, name).largest, summary.sigma.value
        if error > max(VISIBLE * sigma, _rounding(audited, name)) and sigma > 0.0:
            scale = drawn.run.scales[name]
            visible[name] = VisibleError(error, error / sigma, scale)
    by_size = sorted(visible, key=lambda name: -visible[name].of_sigma)
    return {name: visible[name] for name in by_size}


def _wrong_numbers(
    drawn: Drawn, audited: Audited, name: str, summary: Summary
) -> dict[str, WrongNumber]:
    """Return printed numbers whose errors exceed their intervals, and are visible."""
    numbers = {
        n: x
        for n, x in by_name(summary.mean, summary.sigma, summary.quantiles).items()
        if x.sure and math.isfinite(x.value)
    }
    error = _errors(drawn.run, audited, name)
    least = min((min(x.upper - x.value, x.value - x.lower) for x in numbers.values()),
                default=math.inf)  # fmt: skip
    # no number errs more than sigma can, twice the largest error
    if not 2 * error.largest > least or not error.largest > _rounding(audited, name):
        return {}
    errors = _effect(drawn, error, name, summary).numbers
    scale = drawn.run.scales[name]

    def printed(number: Estimate, error: float) -> str:
        return scale.interval(*(x - error for x in number[:3]))[0]

    return {
        n: WrongNumber(x, errors[n])
        for n, x in numbers.items()
        if not x.lower <= x.value - errors[n] <= x.upper
        and printed(x, 0.0) != printed(x, errors[n])
    }


def _rounding(audited: Audited, name: str) -> float:
    """Return the size of an error that is of rounding, beside the response itself."""
    return ROUNDING * float(np.nanmax(np.abs(audited.responses[name]), initial=0.0))


def unseen_errors(
    drawn: Drawn, summaries: Mapping[str, Summary]
) -> UnseenErrors | None:
    """Return what the audit cannot see; None where no verdict rests on it."""
    audited = [
        drawn.audited(name)
        for name, summary in summaries.items()
        if summary.limited and summary.limited.yields.verdict != UNDECIDED
        and not drawn.sample.weights
    ]  # fmt: skip
    moved = [response.moved[response.at_random] for response in audited if response]
    if not moved or not (number := len(moved[0])):
        return None
    count = int(np.count_nonzero(np.any(moved, axis=0)))
    return UnseenErrors(number, count, proportion(count, number))


def _reasons(audited: Audited, name: str) -> NDArray[np.uint8]:
    none = np.zeros(len(audited.trials), np.uint8)
    return audited.chosen_by.get(name, none)


def _errors(run: Run, audited: Audited, name: str) -> IntegrationError:
    ran = (audited.status == Status.DONE) & (run.status[audited.trials] == Status.DONE)
    precise = np.where(ran, audited.responses[name], np.nan)
    if third := audited.third:  # of these the best is known
        done = third.status == Status.DONE
        where = np.searchsorted(audited.trials, third.trials[done])
        precise[where] = np.where(
            ran[where], third.responses[name][done], precise[where]
        )
    alike = audited.at_random | (_reasons(audited, name) > 0)
    return integration_error(run.column(name), audited.trials, precise, alike)


def _effect(
    drawn: Drawn, error: IntegrationError, name: str, summary: Summary
) -> Effect:
    better: Array = error.removed(drawn.run.column(name))[drawn.trials]
    sample, limited = drawn.sample, summary.limited
    done, moved = better[sample.done], None
    sigma = float(done.std(ddof=1)) if len(done) > 1 else math.nan
    limit = limited.limit.permitted if limited else None
    quantiles = quantiles_at(better, sample, [*summary.quantiles], limit)
    if limited:
        again = yield_of(better, sample, limited.limit.permitted).fraction_out_of_limit
        moved = limited.yields.fraction_out_of_limit.value - again.value
    return Effect(
        summary.mean.value - float(done.mean()),
        summary.sigma.value - sigma,
        {q: summary.quantiles[q].value - x.value for q, x in quantiles.items()},
        moved,
    )
