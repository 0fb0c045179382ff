"""The summary and the report of sampled trials, gathered from the run file alone."""

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Any

import numpy as np

from tolstat.answers import run_answer
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
from tolstat.answers.report.off_centre import OffCentre, off_centre
from tolstat.answers.report.report_answer import NoCause, Report, RunSummary
from tolstat.answers.report.report_warnings import jumping, warnings_of
from tolstat.answers.report.response_summary import (
    ReportedResponse,
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
from tolstat.statistics.limits.yields import INTEGRATION_ERROR, Caveat
from tolstat.statistics.point_mass import point_mass_of
from tolstat.statistics.sensitivity import linear
from tolstat.statistics.summary import Limited
from tolstat.store.stored_run import Run

MOST_DEVIATIONS = 3  # of a worst trial
MOST_ILLUSTRATED = 12  # responses of a page: their figures take longer than all else
FEWEST_WITHIN = 0.1  # of the trials, of which those out of limit differ


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
    centres, rough = dict[str, OffCentre | None](), False
    for name in causes:
        limited = summaries[name].limited
        wrong = limited and limited.yields.reason == INTEGRATION_ERROR
        rough |= bool(wrong)
        if not (wrong or name in clusters):
            centres[name] = off_centre(drawn, name, summaries[name])
        if none := _no_cause(limited, centres.get(name), jumps=name in clusters):
            causes[name] = causes[name]._replace(reason=none, named=())
        if name in clusters:
            causes[name] = causes[name]._replace(needed=0)
    responses = {
        name: ResponseSummary(
            **vars(described),
            causes=causes.get(name),
            contributions=contributions.get(name),
            members=members if name in focus else {},
            off_centre=centres.get(name),
        )
        for name, described in summaries.items()
    }
    warnings = (
        *integration_warnings(drawn, summaries),
        *warnings_of(drawn, clusters, unsettled=rough),
    )
    return RunSummary(
        **run_answer.fields_of(run, trial_counts(drawn)),
        warnings=warnings,
        unseen_errors=unseen_errors(drawn, summaries),
        all_limits=all_limits(drawn),
        responses=responses,
        numbers=numbers_of_study(run),
        findings=findings_of(run, responses, warnings),
    )


def _no_cause(
    limited: Limited | None, offset: OffCentre | None, *, jumps: bool
) -> NoCause | None:
    """Return why no contributor may be named as a cause; None if one may.

    What is wrong has no cause among the parts, and of a response off centre the trials
    out of limit show none.
    """
    if jumps:
        return NoCause.JUMPS
    if limited and limited.yields.reason == INTEGRATION_ERROR:
        return NoCause.INTEGRATION_ERROR
    if limited and limited.yields.reason == Caveat.FEW_PARTS:
        return NoCause.FEW_PARTS
    mostly_out = limited and limited.yields.within.value < FEWEST_WITHIN
    return NoCause.OFF_CENTRE if offset and (offset.tolerances or mostly_out) else None


def report_of(run: Run, chosen: Sequence[str] = ()) -> Report:
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
    )


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
