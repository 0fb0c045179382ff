"""The summary and the report of sampled trials, gathered from the run file alone."""

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Any

import numpy as np

from tolstat.answers import run_answer
from tolstat.answers.parts.judged_parts import judged_parts_of
from tolstat.answers.report.chosen_steps import findings_of
from tolstat.answers.report.integration import (
    integration_of,
    integration_warnings,
    unseen_errors,
)
from tolstat.answers.report.main_causes import (
    contributions_of,
    indices_of,
    main_causes,
)
from tolstat.answers.report.report_answer import NoCause, Report, RunSummary
from tolstat.answers.report.report_warnings import (
    VerdictWarning,
    decided_by_errors,
    jumping,
    warnings_of,
)
from tolstat.answers.report.response_summary import (
    ReportedResponse,
    RequestedQuantiles,
    ResponseSummary,
    WorstTrial,
)
from tolstat.answers.report.summaries import (
    all_limits,
    described_responses,
    numbers_of_study,
    reportable,
    trial_counts,
)
from tolstat.answers.sampled_trials import Drawn
from tolstat.errors import QuestionError
from tolstat.statistics.intervals.shortest import shortest_interval
from tolstat.statistics.limits.yields import Caveat
from tolstat.statistics.point_mass import point_mass_of
from tolstat.statistics.sample import quantiles_at
from tolstat.statistics.sensitivity import linear
from tolstat.statistics.summary import Limited
from tolstat.store.stored_run import Run

MOST_DEVIATIONS = 3  # of a worst trial
MOST_ILLUSTRATED = 12  # responses of a page: their figures take longer than all else


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
    errors = tuple(integration_warnings(drawn, summaries))
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
            members=members if name in focus else {},
        )
        for name, described in summaries.items()
    }
    unsettled = any(isinstance(warning, VerdictWarning) for warning in errors)
    warnings = (
        *errors,
        *warnings_of(drawn, clusters, unsettled=unsettled),
    )
    return RunSummary(
        **run_answer.fields_of(run, trial_counts(drawn)),
        warnings=warnings,
        unseen_errors=unseen_errors(drawn, summaries),
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
    if wrong:
        return NoCause.INTEGRATION_ERROR
    if limited and limited.yields.reason == Caveat.FEW_PARTS:
        return NoCause.FEW_PARTS
    return None


def report_of(
    run: Run, chosen: Sequence[str] = (), quantiles: Sequence[float] = ()
) -> Report:
    """Return the report of a run whose trials were sampled; see `report`."""
    drawn, focus = reportable(run, chosen)
    summary = summary_of(drawn, focus)
    if not chosen:
        focus = [name for name in summary.limits if name in focus] or focus
    scatter, diagnostics, sample = _scatter(drawn), run.diagnostics, drawn.sample
    replicate = sample.replicate[sample.done] if sample.replicates else None
    responses = {}
    for response in run.responses:
        name = response.name
        summarized, slopes = summary.responses[name], diagnostics.slopes.get(name, {})
        analysed = name in focus and not summarized.still
        by_slopes = scatter and linear.root_sum_square(
            summarized.nominal, slopes, scatter
        )
        unanalysed: dict[str, Any] = {"contributions": None, "members": {}}
        reported = ReportedResponse(
            **vars(summarized) | ({} if analysed else unanalysed),
            symbol=response.symbol,
            source=response.source,
            integration_errors=integration_of(drawn, name, summarized),
            slopes=slopes,
            root_sum_square=by_slopes,
            departures=tuple(linear.departures(by_slopes, summarized.quantiles))
            if by_slopes
            else (),
            worst_cases=run.worst_cases(name),
            requested=_requested(drawn, name, quantiles) if name in focus else None,
            worst_trials=(),
            point_mass=point_mass_of(drawn.done(name), replicate) if analysed else None,
            indices=indices_of(drawn, name) if analysed and drawn.grouped else None,
        )
        worst = _worst_trials(run, name, reported.leading[:MOST_DEVIATIONS])
        responses[name] = replace(reported, worst_trials=worst)
    return Report(
        **{**vars(summary), "responses": responses},
        focus=tuple(focus),
        # the worst limits come first; what was requested by name is drawn
        illustrated=tuple(focus if chosen else focus[:MOST_ILLUSTRATED]),
        measured_parts=judged_parts_of(run),
    )


def _requested(
    drawn: Drawn, name: str, quantiles: Sequence[float]
) -> RequestedQuantiles | None:
    """Return quantiles of a reader's choice; None where none is requested."""
    if not quantiles:
        return None
    for share in quantiles:
        if not 0 < share < 1:
            example = 'such as 0.025 or "2.5 %"'
            raise QuestionError(
                f"quantile {share:g}: a share between 0 and 1 is needed, {example}"
            )
    limit = drawn.run.limits.get(name)
    permitted = limit.permitted if limit else None
    estimates = quantiles_at(
        drawn.values(name), drawn.sample_for(name), sorted(quantiles), permitted
    )
    share = max(quantiles) - min(quantiles)
    shortest = (math.nan, math.nan)
    if share and not drawn.sample.weights:
        shortest = shortest_interval(drawn.done(name), share)
    return RequestedQuantiles(estimates, share, shortest)


def _scatter(drawn: Drawn) -> linear.Scatter | None:
    """Return how the deviations scatter; None without slopes.

    From the distributions where all deviations are independent, else from trials.
    """
    run = drawn.run
    slopes = run.diagnostics.slopes
    if not slopes or len(drawn.trials) < 2:
        return None
    varying = tuple(next(iter(slopes.values())))
    assumed = [run.assumed[name] for name in varying]
    sigmas = np.array([part.sigma for part in assumed])
    if np.isfinite(sigmas).all() and run.independent:
        means = np.array([part.mean for part in assumed])
        return linear.Scatter(varying, means, np.diag(sigmas**2))
    return linear.scatter_of({name: drawn.values(name) for name in varying})


def _worst_trials(
    run: Run, response: str, contributors: Sequence[str]
) -> tuple[WorstTrial, ...]:
    """Return the worst trials with some of their deviations."""
    if response not in run.limits:
        return ()

    precise = dict[int, float]()
    if again := run.audited:
        values = again.responses[response].tolist()
        precise = dict(zip(again.trials.tolist(), values, strict=True))
    columns = {name: run.column(name) for name in (response, *contributors)}
    rows = {
        trial: {name: float(column[trial]) for name, column in columns.items()}
        for trial in run.worst_trials(response)
    }
    return tuple(
        WorstTrial(trial, row.pop(response), precise.get(trial, math.nan), row)
        for trial, row in rows.items()
    )
