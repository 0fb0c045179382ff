"""The tables at the end of a run: responses, limits, and what they rest on."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tolstat.report.drawn import Drawn, drawn_trials
from tolstat.report.numbers import in_engineering_unit, limit_in_words, number
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.sample import Sample
from tolstat.statistics.summary import Limited, Summary, summarize
from tolstat.status import Status
from tolstat.store.run import Run
from tolstat.units.conversion import engineering_unit

SHARES = {0.5: "median", 0.05: "5 %", 0.95: "95 %", 0.99: "99 %"}
EXTREMES = ("least", "in trial", "largest", "in trial")

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


def summaries_of(drawn: Drawn) -> dict[str, Summary]:
    """Summarize every response of a run whose machines were drawn."""
    run, found = drawn.run, {}
    for response in run.responses:
        name = response.name
        asked = (run.limits[name], run.demanded[name]) if name in run.limits else ()
        found[name] = summarize(drawn.values(name), drawn.sample, *asked)
    return found


def summary_table(run: Run) -> SummaryTable:
    """Summarize a run for the screen.

    Parameters
    ----------
    run : Run
        Complete or not.

    Returns
    -------
    SummaryTable
        Engineering units. Of trials that were drawn quantiles and shares, each with its
        95 % interval; of a grid or a table, whose machines were chosen, the extremes
        and where they are.
    """
    drawn = drawn_trials(run)
    sample = drawn.sample if drawn else None
    summaries = summaries_of(drawn) if drawn else {}
    rows: list[list[Cell]] = []
    limit_rows: list[list[Cell]] = []
    for response in run.responses:
        name, unit = response.name, response.unit
        row: list[Cell] = [name, engineering_unit(unit)]
        row.append(in_engineering_unit(run.nominal_values[name], unit))
        if name in summaries:
            quantiles = summaries[name].quantiles
            row += [estimate_in_words(quantiles[share], unit) for share in SHARES]
            if limited := summaries[name].limited:
                limit_rows.append([name, *_judged(limited, unit)])
        else:
            row += _extremes(run, name, unit)
            if name in run.limits:
                limit = limit_in_words(run.limits[name], unit)
                limit_rows.append([name, limit, _beyond(run, name)])
        rows.append(row)
    judged = ["limit", "demanded", "verdict", "% beyond", "Ppk"]
    return SummaryTable(
        f"{run.facts['title']}: {run.trials} trials of {run.facts['model']}",
        ["response", "unit", "nominal", *(SHARES.values() if sample else EXTREMES)],
        rows,
        ["response", *(judged if sample else ["limit", "machines beyond"])],
        limit_rows,
        notes_of(run, sample),
    )


def estimate_in_words(estimate: Estimate, unit: str) -> Cell:
    """Write an estimate with its interval, or why it has none."""
    value = in_engineering_unit(estimate.value, unit)
    if estimate.sure:
        lower = in_engineering_unit(estimate.lower, unit)
        return value, lower, in_engineering_unit(estimate.upper, unit)
    if estimate.reason.startswith("needs"):
        return estimate.reason
    return f"{value}: no interval"


def _judged(limited: Limited, unit: str) -> list[Cell]:
    """Write what a limit asks for and what the machines say."""
    verdict = limited.yields.verdict
    if limited.yields.needed:
        verdict += f": needs {limited.yields.needed}"
    ppk = limited.percentiles.ppk
    words: Cell = ppk.reason
    if ppk.sure:
        words = (number(ppk.value), number(ppk.lower), number(ppk.upper))
    return [
        limit_in_words(limited.limit, unit),
        f"{100 * limited.demanded:g} %",
        verdict,
        estimate_in_words(limited.yields.beyond, "1"),
        words,
    ]


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


def _beyond(run: Run, name: str) -> str:
    """Count the machines beyond a limit, failed ones among them."""
    lower, upper = run.limits[name]
    ended = run.trials - run.counts[Status.NOT_RUN.word]
    with np.errstate(invalid="ignore"):
        within = (run.column(name) >= lower) & (run.column(name) <= upper)
    return f"{ended - np.count_nonzero(within)} of {ended}"


def notes_of(run: Run, sample: Sample | None) -> list[str]:
    """Say what must be known to read the numbers of a run: failures first."""
    counts = run.counts
    ended = run.trials - counts[Status.NOT_RUN.word]
    failed = ended - counts[Status.DONE.word]
    notes = []
    if ended:
        text = f"{failed} of {ended} trials failed"
        if sample and (share := sample.failures).sure:
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
    if "until" in run.facts:
        reached = "reached" if run.facts["until_reached"] else "not reached"
        stages = ", ".join(run.facts["until_stages"].split())
        notes.append(
            f"{run.facts['until']}: {reached}; looked at after {stages} trials"
        )
    if sample and not sample.replicates:
        notes.append(
            "with each number its 95 % interval: order statistics for quantiles, "
            "Clopper-Pearson for shares; "
            '"needs N": no interval exists with fewer trials'
        )
    elif sample:
        notes.append(f"with each number its 95 % interval: {run.facts['promise']}")
    return notes
