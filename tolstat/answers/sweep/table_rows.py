"""A run of a table as rows: one for each machine."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tolstat.answers.report.gather import responses_of_interest
from tolstat.status import Status
from tolstat.store.stored_run import Run

MOST_ROWS = 40


class TableRows(NamedTuple):
    """Machines as text.

    Attributes
    ----------
    title : str
        What the rows are.
    heads : list of str
        Columns: a name, over its unit.
    rows : list of list of str
        One for each machine, at most `MOST_ROWS`.
    notes : list of str
        What all of them have alike, and where the others are.
    """

    title: str
    heads: list[str]
    rows: list[list[str]]
    notes: list[str]


def table_rows(run: Run) -> TableRows:
    """List the machines of a table: how they differ, what they answer, how they ended.

    Parameters
    ----------
    run : Run
        With sampling = "table", complete or not.

    Returns
    -------
    TableRows
        Of each machine the deviations that are not alike in all, what has a limit (the
        first responses if nothing has), its status and the limits it is beyond.
    """
    known = {each.name: run.column(each.name) for each in run.contributors}
    differing = [name for name, column in known.items() if np.ptp(column) > 0]
    alike = [name for name, column in known.items() if column[0] and not np.ptp(column)]
    if run.trials == 1:
        differing, alike = alike, []
    answers = responses_of_interest(run)
    beyonds = {name: run.beyond(name) for name in run.limits}
    shown = [*differing, *answers]
    labels = [f"{name}\n{run.scales[name].mark}" for name in shown]
    rows = []
    for trial in range(min(run.trials, MOST_ROWS)):
        ran = run.status[trial] != Status.NOT_RUN
        cells = [
            run.scales[name].number(float(run.column(name)[trial]))
            if ran or name in known
            else ""
            for name in shown
        ]
        done = run.status[trial] == Status.DONE
        beyond = ", ".join(n for n in beyonds if beyonds[n][trial]) if done else ""
        rows.append([str(trial), *cells, run.ended_as(trial), beyond])
    notes = []
    if alike:
        same = (f"{name} {run.scales[name].words(known[name][0])}" for name in alike)
        notes.append(f"in all of them {', '.join(same)}")
    if len(rows) < run.trials:
        notes.append(
            f"the first {len(rows)} of {run.trials} machines; one of them by `tolstat "
            f'trial {run.path} NUMBER`, all by tolstat.open("{run.path}").frame()'
        )
    heads = ["trial", *labels, "status", "beyond"]
    return TableRows(f"{run.title}: its machines", heads, rows, notes)
