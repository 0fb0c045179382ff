"""A grid run beside the points that its study refers to."""

from __future__ import annotations

import numpy as np

from tolstat.answers.sweep.curves import Sweep, axis_scale, sweeps
from tolstat.document.blocks import Given, Table, table
from tolstat.document.inline import Number, text
from tolstat.store.stored_run import Run


def comparisons(run: Run) -> list[Table]:
    """Compare a grid run with its reference, response by response.

    Parameters
    ----------
    run : Run
        With a reference, or not: then there is nothing to compare.

    Returns
    -------
    list of Table
        For each response of the reference and each curve of the run; of points that say
        where on the other axes they are, those that lie on the curve.
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
