"""The summary and the report of a run, whatever its sampling."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from tolstat.answers.report.gather import summary_of
from tolstat.answers.report.report_answer import RunSummary
from tolstat.answers.run_answer import responses_in_focus
from tolstat.answers.sampled_trials import drawn_trials
from tolstat.store.open_run import RunSource
from tolstat.store.open_run import open as open_run
from tolstat.store.stored_run import Run

if TYPE_CHECKING:
    from tolstat.answers.rare.rare_answer import RareSummary
    from tolstat.answers.report.full_report import Report
    from tolstat.answers.sweep.extremes import Extremes
    from tolstat.model.contract import Model


def summary(
    run: RunSource, *, model: Model | None = None
) -> RunSummary | RareSummary | Extremes:
    """Return the summary of a run: verdicts, main causes, responses.

    Parameters
    ----------
    run : Run or path
        Complete or not.
    model : Model, optional
        As of `report`.

    Returns
    -------
    RunSummary, RareSummary or Extremes
        By its sampling: of trials sampled from production, of a rare run, of a grid or
        a table.

    Raises
    ------
    RunFileError
        If the run cannot be read.

    Examples
    --------
    >>> tolstat.summary("runs/stack-up.h5")
    <tolstat summary: stack-up.h5, 10000 trials; gap undecided>
    """
    run = open_run(run)
    if run.aim and run.ended:
        return _rare_summary(run)
    if drawn := drawn_trials(run, model):
        return summary_of(drawn, responses_in_focus(run))
    return _extremes(run)


def report(
    run: RunSource,
    responses: Sequence[str] = (),
    quantiles: Sequence[float] = (),
    *,
    model: Model | None = None,
) -> Report | RareSummary | Extremes:
    """Return the statistical tolerance report of a run.

    Nothing is simulated but new trials that prove a remedy, if these are quick.

    Parameters
    ----------
    run : Run or path
        The report needs only its file, not the model.
    responses : sequence of str
        Responses in focus; see `responses_in_focus`.
    quantiles : sequence of float
        More quantiles of these, such as `(0.025, 0.975)`, and the shortest interval
        with the share between the outer two. Of sampled trials.
    model : Model, optional
        The custom model of the run: proves a remedy, if it is quick.

    Returns
    -------
    Report, RareSummary or Extremes
        By its sampling, as of `summary`. `save` writes its page (.html), its numbers
        (.json) or its table (.csv).

    Raises
    ------
    QuestionError
        If the run has no such response.
    RunFileError
        If the run cannot be read.

    Examples
    --------
    >>> found = tolstat.report("runs/stack-up.h5")
    >>> found.save("stack-up.html").name
    'stack-up.html'
    >>> found.frame()["fraction_out_of_limit"]["gap"].item()
    0.005
    """
    run = open_run(run)
    if run.aim:
        return _rare_summary(run, responses)
    if run.sampled is None:
        return _extremes(run, responses)
    from tolstat.answers.report.full_report import report_of  # a summary needs none

    return report_of(run, responses, quantiles, model)


# trials that are no sample of production: each is loaded for its kind of run alone
def _rare_summary(run: Run, responses: Sequence[str] = ()) -> RareSummary:
    from tolstat.answers.rare.rare_answer import rare_summary

    return rare_summary(run, responses)


def _extremes(run: Run, responses: Sequence[str] = ()) -> Extremes:
    from tolstat.answers.sweep.extremes import extremes_of

    return extremes_of(run, responses)
