"""The summary and the report of a run, gathered from its file alone."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np

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
    WorstTrial,
)
from tolstat.answers.report.run_notes import notes_of
from tolstat.answers.report.variance import contributions_of, indices_of
from tolstat.answers.sampled_trials import Drawn, drawn_trials, no_sample
from tolstat.errors import PictureError, allowed_names
from tolstat.statistics.estimate import CONFIDENCE
from tolstat.statistics.intervals.moments import unseen
from tolstat.statistics.intervals.replicates import never_met
from tolstat.statistics.limits.yields import joint_yield
from tolstat.statistics.point_mass import point_mass_of
from tolstat.statistics.sensitivity.linear import (
    Scatter,
    departures,
    root_sum_square,
    scatter_of,
)
from tolstat.statistics.summary import Summary, summarize
from tolstat.store.stored_run import Run

MOST_IN_FOCUS = 8  # responses, where no limit says which ones matter
NAMED = 3  # contributors of a worst trial


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
    if (drawn := drawn_trials(run)) is None:
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
    run, causes = drawn.run, main_causes(drawn)
    summaries = summaries_of(drawn)
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
    numbers = {
        each.name: NumberOfStudy(
            each.value, run.scale_of(each), each.sentence, each.caveat
        )
        for each in run.numbers
    }
    return RunSummary(
        title_block_of(run), run.title, run.path.name, run.model, _trials(drawn),
        all_limits(drawn), responses, numbers, run,
    )  # fmt: skip


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
    scatter, evidence, sample = _scatter(drawn), run.diagnostics, drawn.sample
    replicate = sample.replicate[sample.done] if sample.replicates else None
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
        if name in focus:
            found = replace(
                found,
                point_mass=point_mass_of(drawn.done(name), replicate),
                members=members,
                indices=indices_of(drawn, name) if drawn.grouped else None,
            )
        worst = _worst_trials(run, name, found.leading[:NAMED])
        responses[name] = replace(found, worst_trials=worst)
    return Report(
        **{**vars(summary), "responses": responses},
        focus=tuple(focus),
        assumptions=assumptions_of(run),
        provenance=provenance_of(run),
    )


def _scatter(drawn: Drawn) -> Scatter | None:
    """Return how the deviations scatter; None without slopes.

    By the distributions where each deviation is independent, else by the trials.
    """
    run = drawn.run
    slopes = run.diagnostics.slopes
    if not slopes or len(drawn.trials) < 2:
        return None
    varying = tuple(next(iter(slopes.values())))
    assumed = [run.assumed[name] for name in varying]
    sigmas = np.array([each.sigma for each in assumed])
    if np.isfinite(sigmas).all() and run.independent:
        means = np.array([each.mean for each in assumed])
        return Scatter(varying, means, np.diag(sigmas**2))
    return scatter_of({name: drawn.values(name) for name in varying})


def _worst_trials(
    run: Run, response: str, named: Sequence[str]
) -> tuple[WorstTrial, ...]:
    """List the worst trials with some of their deviations."""

    def at(name: str, trial: int) -> float:
        return float(run.column(name)[trial])

    return tuple(
        WorstTrial(each.trial, at(response, each.trial), each.precise,
                   {name: at(name, each.trial) for name in named})
        for each in run.diagnostics.worst.get(response, ())
    )  # fmt: skip


def _trials(drawn: Drawn) -> TrialCounts:
    run, sample = drawn.run, drawn.sample
    done = int(np.count_nonzero(sample.done))
    outside = unseen(done)
    if sample.replicates:  # at either end, which the trials choose themselves
        outside = min(2 * never_met(done, sample.replicates), 1.0)
    return TrialCounts(
        run.trials, run.ended, done, sample.failed, len(drawn.trials), run.counts,
        sample.failures, outside, run.sampling, drawn.sampled.promise,
        tuple(notes_of(run, sample)),
    )  # fmt: skip


def all_limits(drawn: Drawn) -> AllLimits | None:
    """Estimate the yield of all limits at once; None without any."""
    limits = {name: limit.permitted for name, limit in drawn.run.limits.items()}
    if not limits or not drawn.sample.ran.any():
        return None
    values = {name: drawn.values(name) for name in limits}
    within = joint_yield(values, drawn.sample, limits)
    n = len(limits)
    return AllLimits(n, within, min(n * (1 - CONFIDENCE) / 2, 1.0))


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
    deviations = {
        each.name: SampledDeviation(
            assumed.words, *assumed.tolerance, run.scales[each.name], each.sentence
        )
        for each in run.contributors
        if (assumed := run.assumed.get(each.name))
    }
    return Assumptions(
        deviations, run.correlation, run.settings, run.assumptions,
        run.diagnostics.missing,
    )  # fmt: skip
