"""The tables at the end of a run: responses, limits, and what they rest on."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from tolstat.report.numbers import in_engineering_unit, limit_in_words, number
from tolstat.statistics.proportions import Proportion, proportion
from tolstat.statistics.quantiles import Quantile
from tolstat.statistics.summary import SHARES, summarize
from tolstat.status import Status
from tolstat.store.run import Run
from tolstat.units.conversion import engineering_unit

# a text, or a number with the ends of its interval
Cell = str | tuple[str, str, str]


class SummaryTable(NamedTuple):
    """Tables of text.

    Attributes
    ----------
    title : str
        What the run is.
    heads : list of str
        Columns of the table of responses.
    rows : list of list of Cell
        One for each response.
    limit_heads : list of str
        Columns of the table of limits.
    limit_rows : list of list of Cell
        One for each limit; empty without limits.
    notes : list of str
        What must be known to read them: failures first.
    """

    title: str
    heads: list[str]
    rows: list[list[Cell]]
    limit_heads: list[str]
    limit_rows: list[list[Cell]]
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
        Engineering units. Of random trials quantiles and shares, each with its 95 %
        interval; of Latin hypercube and Sobol' trials the same without intervals,
        which one such sample does not bear; of a grid or a table, whose machines were
        chosen, the extremes and where they are.
    """
    drawn = "promise" in run.facts
    independent = run.facts["sampling"] == "random"
    quantiles = ["median" if share == 0.5 else f"{100 * share:g} %" for share in SHARES]
    rows: list[list[Cell]] = []
    limit_rows: list[list[Cell]] = []
    for response in run.responses:
        name, unit = response.name, response.unit
        row: list[Cell] = [name, engineering_unit(unit)]
        row.append(in_engineering_unit(run.nominal_values[name], unit))
        summary = summarize(run.column(name), run.status, run.limits.get(name))
        if drawn:
            row += [_quantile(q, unit, independent) for q in summary.quantiles]
        else:
            row += _extremes(run, name, unit)
        rows.append(row)
        if summary.beyond:
            limit = limit_in_words(run.limits[name], unit)
            limit_rows.append([name, limit, _beyond(summary.beyond, run, independent)])
    extremes = ["least", "in trial", "largest", "in trial"]
    return SummaryTable(
        f"{run.facts['title']}: {run.trials} trials of {run.facts['model']}",
        ["response", "unit", "nominal", *(quantiles if drawn else extremes)],
        rows,
        ["response", "limit", "% beyond" if drawn else "machines beyond"],
        limit_rows,
        _notes(run, drawn, independent),
    )


def _extremes(run: Run, name: str, unit: str) -> list[Cell]:
    """Write the least and the largest value, each with its trial."""
    done = np.flatnonzero(run.status == Status.DONE)
    if not len(done):
        return ["failed", "", "failed", ""]
    values = run.column(name)[done]
    cells: list[Cell] = []
    for where in (values.argmin(), values.argmax()):
        cells += [in_engineering_unit(float(values[where]), unit), str(done[where])]
    return cells


def _beyond(beyond: Proportion, run: Run, independent: bool) -> Cell:
    """Write how many machines are beyond a limit, as the sampling allows."""
    share, lower, upper = (number(100 * each) for each in beyond)
    if independent:
        return share, lower, upper
    if "promise" in run.facts:
        return share
    ended = run.trials - run.counts[Status.NOT_RUN.word]
    return f"{round(beyond.estimate * ended)} of {ended}"


def _quantile(quantile: Quantile, unit: str, independent: bool) -> Cell:
    """Write a quantile with its interval, or how many trials that would need."""
    if not independent:
        return in_engineering_unit(quantile.estimate, unit)
    if math.isnan(quantile.lower) or math.isnan(quantile.upper):
        return f"needs {quantile.needed}"
    value, lower, upper = (
        in_engineering_unit(each, unit)
        for each in (quantile.estimate, quantile.lower, quantile.upper)
    )
    return value, lower, upper


def _notes(run: Run, drawn: bool, independent: bool) -> list[str]:
    counts = run.counts
    ended = run.trials - counts[Status.NOT_RUN.word]
    failed = ended - counts[Status.DONE.word]
    notes = []
    if ended:
        share = proportion(failed, ended)
        text = f"{failed} of {ended} trials failed"
        if independent:
            text += f" (95 % interval {number(100 * share.lower)}.."
            text += f"{number(100 * share.upper)} %)"
        words = [s.word for s in Status if s > Status.DONE and counts[s.word]]
        if words:
            text += ": " + ", ".join(f"{counts[word]} {word}" for word in words)
            text += "; they count as beyond every limit"
        notes.append(text)
    if ended < run.trials:
        notes.append(f"{run.trials - ended} of {run.trials} trials have not run")
    nominal = run.nominal_values["status"]
    if nominal != Status.DONE.word:
        notes.append(f"the nominal machine: {nominal}")
    notes += run.notes
    if independent:
        notes.append(
            "with each number its 95 % interval: order statistics for quantiles, "
            "Clopper-Pearson for shares; "
            '"needs N": no interval exists with fewer trials'
        )
    elif drawn:
        notes.append(f"without intervals: {run.facts['promise']}")
    return notes
