"""Document about a run of given trials: extremes, limits, trials, reference."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from tolstat.answers.next_steps import command, to_resume
from tolstat.answers.run_answer import responses_in_focus
from tolstat.answers.sweep.curves import TAKEN, Sweep, axis_scale, sweeps
from tolstat.document import blocks
from tolstat.document.blocks import Block, Document, Given, Table, table_of
from tolstat.document.inline import Name, Number, Typed, counted, listed, say, text
from tolstat.status import Status
from tolstat.store.stored_run import Run
from tolstat.units.scale import Scale

if TYPE_CHECKING:
    from tolstat.answers.sweep.extremes import Extreme, Extremes

MOST_ROWS = 40


def extremes_document(found: Extremes) -> Document:
    """Return the extremes of responses, limits, trials of a table, the reference."""
    limits: list[dict[str, Given]] = [
        {
            "response": Name(name),
            "limit": each.limit.words,
            "trials out of limit": text(f"{each.trials_out_of_limit} of {found.ran}"),
        }
        for name, each in found.responses.items()
        if each.limit
    ]
    title = f"{found.title}: {found.trials} trials of {found.model}"
    if not found.ran:
        missing = Typed(to_resume(found.stored_run.path, found.stored_run.machine))
        said = blocks.paragraph("No trial has run. Run them: ", missing)
        return Document(title, (said,))
    return Document(
        title,
        blocks.shown(
            _responses(found),
            table_of(limits, "Limits"),
            *map(blocks.note, found.notes),
            *table_rows(found.stored_run),
            *comparisons(found.stored_run),
        ),
    )


def _responses(found: Extremes) -> Table:
    rows: list[dict[str, Given]] = [
        {
            "response": Name(name),
            "unit": each.scale.mark,
            "nominal": Number(each.nominal, each.scale),
            **_extreme("least", each.least, each.scale),
            **_extreme("largest", each.largest, each.scale),
        }
        for name, each in found.responses.items()
    ]
    return table_of(rows, "Responses", keys=2)


def _extreme(head: str, extreme: Extreme | None, scale: Scale) -> dict[str, Given]:
    if extreme is None:
        return {head: "failed"}
    trial = "all" if extreme.trial is None else Number(extreme.trial)
    return {head: Number(extreme.value, scale), f"{head} in trial": trial}


def table_rows(run: Run) -> list[Block]:
    """Return the trials of a table: their deviations, responses and statuses.

    A row has the deviations that differ between trials, the limited responses (or the
    first ones), the status and the limits it is out of. Common deviations follow. Empty
    unless the run has sampling = "table".
    """
    if run.sampling != "table":
        return []
    known = {each.name: run.column(each.name) for each in run.contributors}
    same = [n for n, x in known.items() if run.trials > 1 and not np.ptp(x)]
    own = [n for n, x in known.items() if n not in same and np.any(x)]
    focus, responses = responses_in_focus(run), [each.name for each in run.responses]
    columns = [*own, *(name for name in responses if name in focus)]
    done = run.status == Status.DONE
    out_of = {n: run.beyond(n) & done for n in responses if n in run.limits}
    rows: list[dict[str, Given]] = []
    for trial in range(min(run.trials, MOST_ROWS)):
        row: dict[str, Given] = {"trial": Number(trial)}
        for name in columns:
            ran = name in known or run.status[trial] != Status.NOT_RUN
            head = f"{name}\n{run.scales[name].mark}"
            row[head] = _cell(run, name, trial) if ran else None
        out = ", ".join(name for name, each in out_of.items() if each[trial])
        rows.append({**row, "status": run.ended_as(trial), "out of limit": out})
    table = table_of(rows, f"{run.title}: trials", words=["out of limit"])
    found: list[Block] = [table]
    values = [(f"{n} ", _cell(run, n, 0)) for n in same if known[n][0]]
    if values:
        found.append(blocks.paragraph("in all trials: ", listed(values, "")))
    if len(rows) < run.trials:
        each = command("trial", run.path, "NUMBER", machine=run.machine)
        part = say("the first {} of {}; ", f"{len(rows)}", counted(run.trials, "trial"))
        every = f'tolstat.open("{run.path}").frame() has all. One of them: '
        found.append(blocks.paragraph(part, every, Typed(each)))
    return found


def _cell(run: Run, name: str, trial: int) -> str | Number:
    value = float(run.column(name)[trial])
    return "failed" if math.isnan(value) else Number(value, run.scales[name])


def comparisons(run: Run) -> list[Table]:
    """Compare a grid run with its reference: a table for each response and curve.

    Points with values on other axes are compared with the curve on which they lie.
    Empty where a run has no reference.
    """
    if not run.reference:
        return []
    axis, *others = run.reference.columns
    return [
        found
        for response in [name for name in others if name not in run.grid]
        for sweep in sweeps(run, axis, response)
        if (found := _compared(run, axis, response, sweep))
    ]


def _compared(run: Run, axis: str, response: str, sweep: Sweep) -> Table | None:
    assert run.reference
    columns = run.reference.columns
    on = np.full(len(columns[axis]), True)
    for name in [name for name in sweep.at if name in columns]:
        on &= np.isclose(columns[name], sweep.at[name], rtol=1e-9, atol=0.0)
    if not on.any():
        return None
    along, scale = axis_scale(run, axis), run.scales[response]._replace(least=0.0)
    at, known = columns[axis][on], columns[response][on]
    here = np.interp(at, sweep.x, sweep.y, left=np.nan, right=np.nan)
    rows = [
        {
            along.label(axis.removeprefix(TAKEN)): Number(x, along),
            "reference": Number(a, scale),
            "run": Number(b, scale),
            "difference": Number(b - a, scale),
        }
        for x, a, b in zip(at.tolist(), known.tolist(), here.tolist(), strict=True)
    ]
    title = f"{scale.label(response)}: {run.reference.label}"
    return table_of(
        rows,
        f"{title} ({sweep.label})" if sweep.label else title,
        caption=() if np.isin(at, sweep.x).all() else text("between points: linear"),
    )
