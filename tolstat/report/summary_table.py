"""The table at the end of a run: one row for each response."""

from __future__ import annotations

from typing import NamedTuple

from tolstat.report.numbers import (
    in_engineering_unit,
    limit_in_words,
    number,
    quantile_with_interval,
    share_with_interval,
)
from tolstat.statistics.proportions import proportion
from tolstat.statistics.summary import SHARES, summarize
from tolstat.status import Status
from tolstat.store.run import Run
from tolstat.units.conversion import engineering_unit


class SummaryTable(NamedTuple):
    """A table of text.

    Attributes
    ----------
    title : str
        What the run is.
    heads : list of str
        One for each column.
    rows : list of list of str
        One for each response.
    notes : list of str
        What must be known to read it: failures first.
    """

    title: str
    heads: list[str]
    rows: list[list[str]]
    notes: list[str]


def summary_table(run: Run) -> SummaryTable:
    """Summarize a run for the screen.

    Parameters
    ----------
    run : Run
        Complete or not.

    Returns
    -------
    SummaryTable
        Engineering units, every number with its 95 % interval under it.
    """
    heads = ["response", "unit", "nominal"]
    heads += ["median" if share == 0.5 else f"{100 * share:g} %" for share in SHARES]
    heads += ["limit", "beyond"]
    rows = []
    limits, nominal = run.limits, run.nominal
    for response in run.responses:
        name, unit = response.name, response.unit
        summary = summarize(run.column(name), run.status, limits.get(name))
        row = [name, engineering_unit(unit), in_engineering_unit(nominal[name], unit)]
        row += [
            quantile_with_interval(quantile, unit) for quantile in summary.quantiles
        ]
        row.append(limit_in_words(limits[name], unit) if name in limits else "")
        row.append(share_with_interval(summary.beyond) if summary.beyond else "")
        rows.append(row)
    title = f"{run.facts['title']}: {run.trials} trials of {run.facts['model']}"
    return SummaryTable(title, heads, rows, _notes(run))


def _notes(run: Run) -> list[str]:
    counts = run.counts
    ended = run.trials - counts[Status.NOT_RUN.word]
    failed = ended - counts[Status.DONE.word]
    notes = []
    if ended:
        share = proportion(failed, ended)
        upper = number(100 * share.upper)
        text = f"{failed} of {ended} trials failed"
        text += f" (95 % interval {number(100 * share.lower)}..{upper} %)"
        words = [s.word for s in Status if s > Status.DONE and counts[s.word]]
        if words:
            text += ": " + ", ".join(f"{counts[word]} {word}" for word in words)
            text += "; they count as beyond every limit"
        notes.append(text)
    if ended < run.trials:
        notes.append(f"{run.trials - ended} of {run.trials} trials have not run")
    nominal = run.nominal["status"]
    if nominal != Status.DONE.word:
        notes.append(f"the nominal machine: {nominal}")
    notes.append(
        "under each number its 95 % interval: order statistics for quantiles, "
        "Clopper-Pearson for shares"
    )
    return notes
