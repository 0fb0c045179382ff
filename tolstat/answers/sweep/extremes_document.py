"""Document about a run of given trials: extremes, limits, trials, reference."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from tolstat.answers.next_steps import command, to_replay, to_resume
from tolstat.answers.report.finding_words import in_words, what_next
from tolstat.answers.report.report_document import sheet
from tolstat.answers.run_answer import responses_in_focus
from tolstat.answers.sweep.curves import (
    TAKEN,
    Sweep,
    axis_scale,
    point_words,
    sweeps,
)
from tolstat.answers.sweep.sweep_figure import point_figure
from tolstat.document import blocks
from tolstat.document.blocks import (
    Block,
    Document,
    Figure,
    Given,
    Paragraph,
    Section,
    Table,
    table_of,
)
from tolstat.document.inline import (
    Name,
    Number,
    Parts,
    Typed,
    Word,
    counted,
    listed,
    say,
    text,
    with_unit,
)
from tolstat.statistics.limits.limit import margins
from tolstat.statistics.limits.yields import MET, NOT_MET
from tolstat.status import Status
from tolstat.store.stored_run import Run
from tolstat.units.scale import Scale

if TYPE_CHECKING:
    from tolstat.answers.sweep.extremes import Extreme, Extremes, Point

MOST_ROWS = 40


def extremes_document(found: Extremes) -> Document:
    """Return limits, picture, next steps, responses, trials of a table, reference."""
    run, pictures, trials = found.stored_run, list[Figure](), tuple[Block, ...]()
    if found.ran:
        pictures = [point_figure(run, name) for name in found.focus]
        trials = (_responses(found), *table_rows(run), *comparisons(run))
    drawn = Section(f"Trials of the {found.sampling}", (*pictures,), "", 3, True)
    return sheet(
        f"{found.trials} trials of a {found.sampling}",
        found,
        blocks.shown(
            in_words(found.warnings),
            Paragraph(_lead(found), "lead"),
            _limits(found),
            drawn,
            what_next(_next_steps(found)),
            *map(blocks.note, found.notes),
        ),
        Section("Responses", trials, "responses"),
        role="",
    )


def _points(found: Extremes, count: int) -> str:
    """Return a count of trials with its noun."""
    noun = "combination" if len(found.stored_run.grid) > 1 else "point"
    noun = noun if found.sampling == "grid" else "trial"
    return f"{count} {noun}{'s' * (count != 1)}"


def _lead(found: Extremes) -> Parts:
    """Say how many trials meet all limits, and which are the best and the worst."""
    limits = sum(each.limit is not None for each in found.responses.values())
    met, ran = found.meet_all, found.ran
    if not ran:
        return text("No trial has run.")
    if not limits:
        return text(f"{_points(found, ran)}. The study limits no response.")
    of = "the limit" if limits == 1 else f"all {limits} limits"
    meets = f"{met} of {_points(found, ran)} meet{'s' * (met == 1)} {of}"
    left = f" So far {ran} of {found.trials} have run." * (ran < found.trials)
    tone = MET if met == ran else "strong" if met else NOT_MET
    return text(Word(meets, tone), ".", *_at(found, "Best", found.best),
                *_at(found, "Worst", found.worst), left or None)  # fmt: skip


def _at(found: Extremes, what: str, point: Point | None) -> Parts:
    if point is None or found.ran < 2:
        return ()
    value = Number(point.value, found.responses[point.response].scale)
    return say(f" {what}: {point.at}, where {{}} is {{}}.", Name(point.response), value)


def _limits(found: Extremes) -> Table:
    """Return in how many trials each limit is met, its worst value, and where."""
    rows: list[dict[str, Given]] = []
    judged = [(n, each) for n, each in found.responses.items() if each.limit]
    for name, each in sorted(judged, key=lambda of: -of[1].trials_out_of_limit):
        ends = [end for end in (each.least, each.largest) if end and each.limit]
        if each.limit is None or not ends:
            continue
        limit = each.limit.permitted
        worst = min(ends, key=lambda end: margins(np.array(end.value), limit))
        trial = worst.trial
        rows.append({
            "response": Name(name),
            "limit": Word(each.limit.words, "limit"),
            "met in": f"{found.ran - each.trials_out_of_limit} of {found.ran}",
            "worst value": with_unit(Number(worst.value, each.scale)),
            "at": "all" if trial is None else point_words(found.stored_run, trial),
        })  # fmt: skip
    return table_of(rows, "Limits", words=["at"], look="verdicts")


def _next_steps(found: Extremes) -> tuple[Parts, ...]:
    """Say what to do next: run the rest, simulate the worst trial, see all."""
    run, machine = found.stored_run, found.stored_run.machine
    if not run.complete:
        left = Typed(to_resume(run.path, machine))
        return (text("Run the trials that are missing: ", left, "."),)
    steps = []
    if found.worst:
        again = Typed(to_replay(run.path, found.worst.trial, machine))
        steps.append(text("See the worst one in detail: ", again, "."))
    others = [name for name in found.responses if name not in found.focus]
    if others:
        drawn = command("report", run.path, "--response", others[0], machine=machine)
        steps.append(say("Draw another response, such as {}: {}.", Name(others[0]),
                         Typed(drawn)))  # fmt: skip
    table = command("export", run.path, "-o", run.path.with_suffix(".csv"))
    return (*steps, text("Write all trials as a table: ", Typed(table), "."))


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
    return table_of(rows, keys=2, look="dense", spare=["nominal"])


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
