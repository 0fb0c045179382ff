"""Summaries of all responses of a run, whatever its sampling."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tolstat.answers import run_answer
from tolstat.answers.report.report_answer import AllLimits, NumberOfStudy
from tolstat.answers.report.report_warnings import turning
from tolstat.answers.report.response_summary import DescribedResponse
from tolstat.answers.run_answer import TrialCounts
from tolstat.answers.sampled_trials import Drawn, drawn_trials, no_sample
from tolstat.errors import QuestionError
from tolstat.model.contract import Model
from tolstat.statistics.estimate import CONFIDENCE
from tolstat.statistics.intervals.moments import unseen
from tolstat.statistics.intervals.replicates import never_met
from tolstat.statistics.limits.yields import JOINT, joint_yield
from tolstat.statistics.summary import Summary, summarize
from tolstat.store.stored_run import Run


def reportable(
    run: Run, chosen: Sequence[str] = (), model: Model | None = None
) -> tuple[Drawn, list[str]]:
    """Return the sampled trials of a report, and its responses in focus.

    Raises
    ------
    QuestionError
        If the trials were not sampled, none has run, or a response is unknown.
    """
    if (drawn := drawn_trials(run, model)) is None:
        raise no_sample(run)
    if not np.any(drawn.sample.ran):
        raise QuestionError(f"{run.path}: no trial has run; there is nothing to report")
    return drawn, run_answer.responses_in_focus(run, chosen)


def summaries_of(drawn: Drawn) -> dict[str, Summary]:
    """Return a summary of every response of a run whose trials were sampled.

    A limited response that jumps as an angle has no verdict.
    """
    limits, sample = drawn.run.limits, drawn.sample
    names = [*limits] if sample.weights or sample.ran.any() else []
    judged = {name: drawn.yield_of(name) for name in names}
    summaries = {
        response.name: summarize(
            drawn.values(response.name),
            drawn.sample_for(response.name),
            limits.get(response.name),
            response.range,
            uncertainty=drawn.uncertainties.get(response.name),
            judged=judged.get(response.name),
        )
        for response in drawn.run.responses
    }
    for name in turning(drawn.run, drawn.trials_done):
        if limited := summaries[name].limited:
            limited = limited._replace(yields=limited.yields.jumping)
            summaries[name] = replace(summaries[name], limited=limited)
    return summaries


def described_responses(drawn: Drawn) -> dict[str, DescribedResponse]:
    """Return `summaries_of` a run, each with how its response is shown."""
    run, summaries = drawn.run, summaries_of(drawn)
    return {
        response.name: DescribedResponse(
            **vars(summaries[response.name]),
            nominal=run.nominal_values[response.name],
            sentence=response.sentence,
            scale=run.scales[response.name],
        )
        for response in run.responses
    }


def trial_counts(drawn: Drawn) -> TrialCounts:
    """Return the counts of the trials of a run, and notes on them."""
    run, sample = drawn.run, drawn.sample
    done = int(np.count_nonzero(sample.done))
    outside = unseen(done)
    if sample.replicates:  # at either end, which the trials choose themselves
        outside = min(2 * never_met(done, sample.replicates), 1.0)
    return TrialCounts(
        run.trials, run.ended, done, sample.failed, done + sample.failed, run.counts,
        sample.failures, outside, run.sampling, drawn.sampled.promise,
        tuple(run_answer.notes_of(replace(run, warnings=()), sample)),
    )  # fmt: skip


def all_limits(drawn: Drawn) -> AllLimits | None:
    """Return the yield of all limits at once; None without any."""
    limits = {name: limit.permitted for name, limit in drawn.run.limits.items()}
    if not limits or not drawn.sample.ran.any():
        return None
    permitted = max(1 - limit.demanded for limit in drawn.run.limits.values())
    judged, uncertainty = drawn.judged(permitted), drawn.uncertainty(JOINT)
    values = {name: judged.values(name) for name in limits}
    sample = judged.sample_for(*limits)
    within = joint_yield(values, sample, limits, uncertainty)
    n = len(limits)
    return AllLimits(n, within, min(n * (1 - CONFIDENCE) / 2, 1.0))


def numbers_of_study(run: Run) -> dict[str, NumberOfStudy]:
    """Return the numbers of the study of a run, by name."""
    return {
        number.name: NumberOfStudy(
            number.value, run.scale_of(number), number.sentence, number.caveat
        )
        for number in run.numbers
    }
