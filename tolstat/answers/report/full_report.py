"""The full report of a run, gathered from its file alone."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tolstat.answers.parts.judged_parts import JudgedParts
from tolstat.answers.parts.parts_cells import named_cells
from tolstat.answers.report.gather import summary_of
from tolstat.answers.report.integration import integration_of
from tolstat.answers.report.main_causes import indices_of
from tolstat.answers.report.report_answer import RunSummary
from tolstat.answers.report.response_summary import (
    ReportedResponse,
    RequestedQuantiles,
    WorstTrial,
)
from tolstat.answers.report.summaries import reportable
from tolstat.answers.sampled_trials import Drawn
from tolstat.document.blocks import Document
from tolstat.document.inline import Row
from tolstat.errors import QuestionError
from tolstat.model.contract import Model
from tolstat.statistics.intervals.shortest import shortest_interval
from tolstat.statistics.point_mass import point_mass_of
from tolstat.statistics.sample import quantiles_at
from tolstat.statistics.sensitivity import linear
from tolstat.store.stored_run import Run

MOST_DEVIATIONS = 3  # of a worst trial
MOST_ILLUSTRATED = 12  # responses of a page: their figures take longer than all else


@dataclass(frozen=True, repr=False)
class Report(RunSummary):
    """The statistical tolerance report of a run."""

    responses: Mapping[str, ReportedResponse]
    focus: tuple[str, ...]  # responses in focus
    illustrated: tuple[str, ...]  # of these, whose figures the page draws
    # by entry, as deviations from the nominal, against the tolerance of the drawing
    measured_parts: Mapping[str, JudgedParts]
    answers = "report"

    def rows(self) -> Sequence[Row]:
        """Return a row for each response; each has the measured parts, too."""
        parts = {
            head: cell
            for name, part in self.measured_parts.items()
            for head, cell in named_cells(name, part).items()
        }
        return [{**row, **parts} for row in super().rows()]

    def _whole(self) -> Document:
        return self.document(whole=True)


def report_of(
    run: Run,
    chosen: Sequence[str] = (),
    quantiles: Sequence[float] = (),
    model: Model | None = None,
) -> Report:
    """Return the report of a run whose trials were sampled; see `report`."""
    drawn, focus = reportable(run, chosen, model)
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
        by_slopes = None
        if scatter and (any(slopes.values()) or summarized.least == summarized.largest):
            by_slopes = linear.root_sum_square(summarized.nominal, slopes, scatter)
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
        measured_parts=drawn.judged_parts,
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
