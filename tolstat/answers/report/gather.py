"""The summary and the report of a run, gathered from its file alone."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Any

import numpy as np

from tolstat.answers.report.classical import scatter_of_run, worst_trials
from tolstat.answers.report.integration import integration_of
from tolstat.answers.report.main_causes import main_causes
from tolstat.answers.report.report_answer import (
    AllLimits,
    Assumptions,
    NumberOfStudy,
    Report,
    ReportedResponse,
    ResponseSummary,
    RunSummary,
    SampledDeviation,
    TitleBlock,
    TrialCounts,
)
from tolstat.answers.report.run_notes import notes_of
from tolstat.answers.report.variance import contributions_of, indices_of
from tolstat.answers.sampled_trials import Drawn, drawn_trials, no_sample
from tolstat.errors import PictureError, allowed_names
from tolstat.statistics.intervals.moments import unseen
from tolstat.statistics.intervals.replicates import never_met
from tolstat.statistics.limits.yields import CONFIDENCE, joint_yield
from tolstat.statistics.point_mass import PointMass, point_mass_of
from tolstat.statistics.sample import Sample
from tolstat.statistics.sensitivity.linear import departures, root_sum_square
from tolstat.statistics.summary import Summary, summarize
from tolstat.store.stored_run import Run

MOST_IN_FOCUS = 8  # responses, where no limit says which ones matter


def responses_in_focus(run: Run, chosen: Sequence[str] = ()) -> list[str]:
    """Choose the responses in focus.

    Parameters
    ----------
    run : Run
        The run.
    chosen : sequence of str
        Names given by the user; else what has a limit, else the first eight responses.

    Raises
    ------
    PictureError
        If a name is not one of the run's responses.
    """
    known = [response.name for response in run.responses]
    chosen = [chosen] if isinstance(chosen, str) else chosen
    for name in chosen:
        if name not in known:
            raise PictureError(f"response {name}: {allowed_names(name, known)}")
    return list(dict.fromkeys(chosen)) or list(run.limits) or known[:MOST_IN_FOCUS]


def reportable(run: Run, chosen: Sequence[str] = ()) -> tuple[Drawn, list[str]]:
    """Return what a report rests on, and its responses in focus.

    Raises
    ------
    PictureError
        If the trials were not sampled, none has run, or a response is unknown.
    """
    drawn = drawn_trials(run)
    if drawn is None:
        raise no_sample(run)
    if not np.any(drawn.sample.ran):
        raise PictureError(f"{run.path}: no trial has run; there is nothing to report")
    return drawn, responses_in_focus(run, chosen)


def summaries_of(drawn: Drawn) -> dict[str, Summary]:
    """Summarize every response of a run whose trials were sampled."""
    limits = drawn.run.limits
    return {
        each.name: summarize(
            drawn.values(each.name), drawn.sample, limits.get(each.name), each.range
        )
        for each in drawn.run.responses
    }


def summary_of(drawn: Drawn) -> RunSummary:
    """Summarize a run: its limits, their main causes, its responses."""
    run, summaries, causes = drawn.run, summaries_of(drawn), main_causes(drawn)
    responses = {
        each.name: ResponseSummary(
            **vars(summaries[each.name]),
            nominal=run.nominal_values[each.name],
            sentence=each.sentence,
            scale=run.scales[each.name],
            causes=causes.get(each.name),
        )
        for each in run.responses
    }
    return RunSummary(**_known(drawn), responses=responses)


def report_of(run: Run, chosen: Sequence[str] = ()) -> Report:
    """Gather the report of a run; of its file alone, nothing is simulated.

    Parameters
    ----------
    run : Run
        Whose trials were sampled.
    chosen : sequence of str
        Responses in focus; see `responses_in_focus`.

    Raises
    ------
    PictureError
        If the trials were not sampled, none has run, or a response is unknown.
    """
    drawn, focus = reportable(run, chosen)
    with ThreadPoolExecutor(1) as other:
        # they take longest: beside all the rest, for NumPy keeps no other waiting
        shares = other.submit(contributions_of, drawn, focus)
        summary = summary_of(drawn)
        errors = {
            name: integration_of(drawn, name, each)
            for name, each in summary.responses.items()
        }
        contributions, members = shares.result()
    scatter, evidence = scatter_of_run(drawn), run.diagnostics
    responses = {}
    for response in run.responses:
        name = response.name
        each, slopes = summary.responses[name], evidence.slopes.get(name, {})
        linear = scatter and root_sum_square(each.nominal, slopes, scatter)
        found = ReportedResponse(
            **vars(each),
            symbol=response.symbol,
            source=response.source,
            integration_errors=errors[name],
            slopes=slopes,
            linear=linear,
            departures=tuple(departures(linear, each.quantiles)) if linear else (),
            worst_cases=evidence.worst_cases.get(name, {}),
            worst_trials=(),
            contributions=contributions.get(name),
        )
        found = replace(found, worst_trials=worst_trials(drawn, name, found.leading))
        if name in focus:
            found = replace(
                found,
                point_mass=_point_mass(name, drawn),
                members=members,
                indices=indices_of(drawn, name) if drawn.grouped else None,
            )
        responses[name] = found
    return Report(
        **{**_known(drawn), "trials": summary.trials, "all_limits": summary.all_limits},
        responses=responses,
        focus=tuple(focus),
        assumptions=assumptions_of(run),
        provenance=provenance_of(run),
    )


def _known(drawn: Drawn) -> dict[str, Any]:
    """Return what a summary and a report say of the run as a whole."""
    run = drawn.run
    return {
        "title_block": title_block_of(run),
        "title": run.title,
        "run": run.path.name,
        "model": run.model,
        "trials": _trials(drawn),
        "all_limits": all_limits(drawn),
        "numbers": {
            each.name: NumberOfStudy(
                each.value, run.scale_of(each), each.sentence, each.caveat
            )
            for each in run.numbers
        },
        "of": run,
    }


def _trials(drawn: Drawn) -> TrialCounts:
    run, sample = drawn.run, drawn.sample
    return TrialCounts(
        run.trials,
        run.ended,
        int(np.count_nonzero(sample.done)),
        sample.failed,
        len(drawn.trials),
        run.counts,
        sample.failures,
        _unseen(sample),
        run.sampling,
        drawn.sampled.promise,
        tuple(notes_of(run, sample)),
    )


def _unseen(sample: Sample) -> float:
    """Return the fraction of production that may lie outside all trials."""
    done = int(np.count_nonzero(sample.done))
    if sample.replicates:
        # at either end, which the trials choose themselves
        return min(2 * never_met(done, sample.replicates), 1.0)
    return unseen(done)


def all_limits(drawn: Drawn) -> AllLimits | None:
    """Estimate the yield of all limits at once; None without any."""
    limits = {name: limit.permitted for name, limit in drawn.run.limits.items()}
    if not limits or not drawn.sample.ran.any():
        return None
    values = {name: drawn.values(name) for name in limits}
    within = joint_yield(values, drawn.sample, limits)
    n = len(limits)
    return AllLimits(n, within, min(n * (1 - CONFIDENCE) / 2, 1.0))


def _point_mass(name: str, drawn: Drawn) -> PointMass | None:
    """Return the value that many trials share."""
    sample = drawn.sample
    replicate = sample.replicate[sample.done] if sample.replicates else None
    return point_mass_of(drawn.done(name), replicate)


def title_block_of(run: Run) -> TitleBlock:
    """Return what the study says of its sheet."""
    return TitleBlock(*(run.document.get(name, "") for name in TitleBlock._fields))


def provenance_of(run: Run) -> dict[str, object]:
    """Say how a run came to be: versions, times, seed, the study as it was written."""
    assert run.sampled is not None
    return {
        **run.provenance,
        "source_digest": run.source_digest,
        "seed": run.sampled.seed,
        "study": run.study.text,
    }


def assumptions_of(run: Run) -> Assumptions:
    """Say what the numbers rest on."""
    return Assumptions(
        {
            each.name: SampledDeviation(
                run.assumed[each.name].words,
                *run.assumed[each.name].tolerance,
                run.scales[each.name],
                each.sentence,
            )
            for each in run.contributors
            if each.name in run.assumed
        },
        run.correlation,
        run.settings,
        run.assumptions,
        run.diagnostics.missing,
    )
