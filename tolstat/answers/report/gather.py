"""The summary of sampled trials, gathered from the run file alone."""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

from tolstat.answers import run_answer
from tolstat.answers.report.chosen_steps import findings_of
from tolstat.answers.report.main_causes import contributions_of, main_causes
from tolstat.answers.report.report_answer import NoCause, RunSummary
from tolstat.answers.report.report_warnings import (
    ReportWarning,
    VerdictWarning,
    decided_by_errors,
    jumping,
    warnings_of,
)
from tolstat.answers.report.response_summary import ResponseSummary
from tolstat.answers.report.summaries import (
    all_limits,
    described_responses,
    numbers_of_study,
    trial_counts,
)
from tolstat.answers.sampled_trials import Drawn
from tolstat.statistics.limits.yields import Caveat
from tolstat.statistics.summary import Limited


def summary_of(drawn: Drawn, focus: Sequence[str]) -> RunSummary:
    """Return the summary of a sampled run: limits, main causes, responses.

    Weighted trials of a rare run tell no causes.
    """
    run = drawn.run
    with ThreadPoolExecutor(1) as other:
        # the slowest part, in parallel: NumPy lets other threads run
        shares = other.submit(contributions_of, drawn, focus)
        causes, summaries = main_causes(drawn), described_responses(drawn)
        contributions, members = shares.result()
    clusters = jumping(run, drawn.trials_done, dict.fromkeys([*run.limits, *focus]))
    errors, unseen = list[ReportWarning](), None
    if run.audited:
        from tolstat.answers.report import integration  # of an audited run alone

        errors += integration.integration_warnings(drawn, summaries)
        unseen = integration.unseen_errors(drawn, summaries)
    limits = {name: x.limited for name, x in summaries.items() if x.limited}
    wrong = decided_by_errors(limits, errors)
    for name in causes:
        limited, jumps = limits.get(name), name in clusters
        if none := _no_cause(limited, jumps=jumps, wrong=name in wrong):
            causes[name] = causes[name]._replace(reason=none, named=())
        if jumps:
            causes[name] = causes[name]._replace(needed=0)
    responses = {
        name: ResponseSummary(
            **vars(described),
            causes=causes.get(name),
            contributions=contributions.get(name),
            members=members.get(name, {}),
        )
        for name, described in summaries.items()
    }
    unsettled = any(isinstance(warning, VerdictWarning) for warning in errors)
    warnings = (*errors, *warnings_of(drawn, clusters, unsettled=unsettled))
    return RunSummary(
        **run_answer.fields_of(run, trial_counts(drawn)),
        warnings=warnings,
        unseen_errors=unseen,
        all_limits=all_limits(drawn),
        responses=responses,
        numbers=numbers_of_study(run),
        findings=findings_of(drawn, responses, warnings),
    )


def _no_cause(limited: Limited | None, *, jumps: bool, wrong: bool) -> NoCause | None:
    """Return why no contributor may be named as a cause; None if one may.

    What is wrong has no cause among the parts.
    """
    if jumps:
        return NoCause.JUMPS
    reason = limited.yields.reason if limited else Caveat.NONE
    if reason == Caveat.FAILED_AGAIN:
        return NoCause.FAILED_AGAIN
    if wrong:
        return NoCause.INTEGRATION_ERROR
    if reason == Caveat.FEW_PARTS:
        return NoCause.FEW_PARTS
    return None
