"""The summary and the report of a run, whatever its sampling."""

from __future__ import annotations

from collections.abc import Sequence

from tolstat.answers.rare.rare_answer import RareSummary, rare_summary
from tolstat.answers.report.gather import report_of, summary_of
from tolstat.answers.report.report_answer import Report, RunSummary
from tolstat.answers.sampled_trials import drawn_trials
from tolstat.answers.sweep.extremes import Extremes, extremes_of
from tolstat.store.open_run import RunSource
from tolstat.store.open_run import open as open_run


def summary(run: RunSource) -> RunSummary | RareSummary | Extremes:
    """Summarize a run: verdicts, main causes, responses.

    Parameters
    ----------
    run : Run or path
        Complete or not.

    Returns
    -------
    RunSummary, RareSummary or Extremes
        By its sampling: of trials sampled from production, of a rare run, of a grid or
        a table.

    Raises
    ------
    RunFileError
        If the run cannot be read.
    """
    run = open_run(run)
    if run.aim and run.ended:
        return rare_summary(run)
    drawn = drawn_trials(run)
    return summary_of(drawn) if drawn else extremes_of(run)


def report(run: RunSource, responses: Sequence[str] = ()) -> Report | RareSummary:
    """Return the statistical tolerance report of a run; nothing is simulated.

    Parameters
    ----------
    run : Run or path
        Whose trials were sampled. The report is made of its file alone: the model need
        not be there.
    responses : sequence of str
        Responses in focus; those with a limit if none are given.

    Returns
    -------
    Report or RareSummary
        `save` writes its page (.html), its numbers (.json) or its table (.csv).

    Raises
    ------
    PictureError
        If the run has no statistics, or no such response.
    RunFileError
        If the run cannot be read.
    """
    run = open_run(run)
    return rare_summary(run, responses) if run.aim else report_of(run, responses)
