"""The trials of a table, a row for each."""

from __future__ import annotations

import math

import numpy as np

from tolstat.answers.next_steps import command
from tolstat.answers.report.gather import responses_in_focus
from tolstat.document.blocks import Block, Column, Given, paragraph, table
from tolstat.document.inline import Number, Typed, counted, listed
from tolstat.status import Status
from tolstat.store.stored_run import Run

MOST_ROWS = 40


def table_rows(run: Run) -> list[Block]:
    """Return the trials of a table: how they differ, what they answer, how they ended.

    Parameters
    ----------
    run : Run
        Complete or not.

    Returns
    -------
    list of Block
        Of each trial the deviations that differ from trial to trial, what has a limit
        (the first responses if nothing has), its status and the limits it is out of;
        then what all have alike. Empty unless the run has sampling = "table".
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
    limited = [name for name in responses if name in run.limits]
    beyonds = {name: run.beyond(name) for name in limited}
    rows: list[list[Given]] = []
    for trial in range(min(run.trials, MOST_ROWS)):
        ran = run.status[trial] != Status.NOT_RUN
        cells = [
            _cell(run, name, trial) if ran or name in known else None for name in shown
        ]
        done = run.status[trial] == Status.DONE
        beyond = [name for name in beyonds if done and beyonds[name][trial]]
        status = run.ended_as(trial)
        rows.append([Number(trial), *cells, status, ", ".join(beyond)])
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
        blocks.append(
            paragraph(
                f"the first {len(rows)} of ", counted(run.trials, "trial"),
                f'; tolstat.open("{run.path}").frame() has all. One of them: ',
                Typed(each),
            )
        )  # fmt: skip
    return blocks


def _cell(run: Run, name: str, trial: int) -> Given:
    value = float(run.column(name)[trial])
    return "failed" if math.isnan(value) else Number(value, run.scales[name])
