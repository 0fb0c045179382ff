"""The trials of a table, a row for each; a grid beside what its study refers to."""

from __future__ import annotations

import math

import numpy as np

from tolstat.answers.next_steps import command
from tolstat.answers.run_answer import responses_in_focus
from tolstat.answers.sweep.curves import Sweep, axis_scale, sweeps
from tolstat.document.blocks import Block, Column, Given, Table, paragraph, table
from tolstat.document.inline import Number, Typed, counted, listed, text
from tolstat.status import Status
from tolstat.store.stored_run import Run

MOST_ROWS = 40


def table_rows(run: Run) -> list[Block]:
    """Return the trials of a table: how they differ, what they answer, how they ended.

    Of each trial the deviations that differ from trial to trial, what has a limit (the
    first responses if nothing has), its status and the limits it is out of; then what
    all have alike. Empty unless the run has sampling = "table".
    """
    if run.sampling != "table":
        return []
    known = {each.name: run.column(each.name) for each in run.contributors}
    differing = [name for name, column in known.items() if np.ptp(column) > 0]
    alike = [name for name, column in known.items() if column[0] and not np.ptp(column)]
    if run.trials == 1:
        differing, alike = alike, []
    focus, responses = responses_in_focus(run), [each.name for each in run.responses]
    shown = [*differing, *(name for name in responses if name in focus)]
    heads = [f"{name}\n{run.scales[name].mark}" for name in shown]
    done = run.status == Status.DONE
    out_of = {n: run.beyond(n) & done for n in responses if n in run.limits}
    rows: list[list[Given]] = []
    for trial in range(min(run.trials, MOST_ROWS)):
        ran = run.status[trial] != Status.NOT_RUN
        cells = [
            _cell(run, name, trial) if ran or name in known else None for name in shown
        ]
        out = ", ".join(name for name, each in out_of.items() if each[trial])
        rows.append([Number(trial), *cells, run.ended_as(trial), out])
    columns: list[Column | str] = [
        "trial",
        *heads,
        "status",
        Column("out of limit", words=True),
    ]
    blocks: list[Block] = [table(columns, rows, f"{run.title}: trials")]
    if alike:
        values = [(f"{n} ", Number(known[n][0], run.scales[n])) for n in alike]
        blocks.append(paragraph("in all of them ", listed(values, "")))
    if len(rows) < run.trials:
        each = command("trial", run.path, "NUMBER", machine=run.machine)
        part = f"the first {len(rows)} of ", *counted(run.trials, "trial")
        every = f'; tolstat.open("{run.path}").frame() has all. One of them: '
        blocks.append(paragraph(part, every, Typed(each)))
    return blocks


def _cell(run: Run, name: str, trial: int) -> Given:
    value = float(run.column(name)[trial])
    return "failed" if math.isnan(value) else Number(value, run.scales[name])


def comparisons(run: Run) -> list[Table]:
    """Compare a grid run with its reference: a table for each response and curve.

    Of points that say where on the other axes they are, those that lie on the curve.
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
    for name in [name for name in list(columns)[1:] if name in run.grid]:
        on &= np.isclose(columns[name], sweep.at[name], rtol=1e-9, atol=0.0)
    if not on.any():
        return None
    along, scale = axis_scale(run, axis), run.scales[response].exact
    at, known = columns[axis][on], columns[response][on]
    here = np.interp(at, sweep.x, sweep.y, left=np.nan, right=np.nan)
    rows: list[list[Given]] = [
        [Number(x, along), Number(a, scale), Number(b, scale), Number(b - a, scale)]
        for x, a, b in zip(at.tolist(), known.tolist(), here.tolist(), strict=True)
    ]
    title = f"{scale.label(response)}: {run.reference.label}"
    return table(
        (along.label(axis), "reference", "run", "difference"),
        rows,
        f"{title} ({sweep.label})" if sweep.label else title,
        caption=() if np.isin(at, sweep.x).all() else text("between points: linear"),
    )
