"""Document about a run of given trials: extremes, limits, trials, reference."""

import math
from collections.abc import Iterator

import numpy as np

from tolstat.answers.next_steps import command
from tolstat.answers.report.finding_words import in_words, step_words, what_next
from tolstat.answers.report.report_document import sheet
from tolstat.answers.run_answer import responses_in_focus
from tolstat.answers.sweep.curves import grid_axis, point_figure, point_words, sweeps
from tolstat.answers.sweep.extremes import Extreme, Extremes, Point
from tolstat.document import blocks
from tolstat.document.blocks import Document, Given, Section, Table, table_of
from tolstat.document.inline import Name, Number, Parts, Word
from tolstat.document.sentences import counted, listed, say, text, with_unit
from tolstat.statistics.limits.limit import margins
from tolstat.statistics.limits.yields import MET, NOT_MET
from tolstat.status import Status
from tolstat.store.stored_run import Run
from tolstat.units.scale import Scale

MOST_ROWS = 40


def extremes_document(extremes: Extremes) -> Document:
    """Return limits, picture, next steps, responses, trials of a table, reference."""
    run, ran = extremes.stored_run, extremes.ran > 0
    pictures = [point_figure(run, name) for name in extremes.focus if ran]
    first = blocks.section("", *pictures[:1], page_only=True)
    title = f"Trials of the {extremes.sampling}"
    others = blocks.section(title, *pictures[1:], page_only=True)
    findings = extremes.findings
    steps = tuple(step_words(run, step) for step in findings.steps)
    trials = [_responses(extremes), *table_rows(run), *comparisons(run)] if ran else ()
    return sheet(
        f"{extremes.trials} trials of a {extremes.sampling}",
        extremes,
        blocks.shown(
            in_words(extremes.warnings),
            blocks.Paragraph(_lead(extremes), "lead"),
            first,
            _limits(extremes),
            what_next(steps),
            *map(blocks.note, extremes.notes),
        ),
        others,
        Section("Responses", tuple(trials), "responses"),
        role="",
    )


def _points(extremes: Extremes, count: int) -> str:
    """Return a count of trials with its noun."""
    noun = "combination" if len(extremes.stored_run.grid) > 1 else "point"
    noun = noun if extremes.sampling == "grid" else "trial"
    return f"{count} {noun}{'s' * (count != 1)}"


def _lead(extremes: Extremes) -> Parts:
    """Say how many trials meet all limits, and which are the best and the worst."""
    limits = sum(response.limit is not None for response in extremes.responses.values())
    met, ran = extremes.meet_all, extremes.ran
    if not ran:
        return text("No trial has run.")
    if not limits:
        return text(f"{_points(extremes, ran)}. The study limits no response.")
    limits_met = "the limit" if limits == 1 else f"all {limits} limits"
    meets = f"{met} of {_points(extremes, ran)} meet{'s' * (met == 1)} {limits_met}"
    rest = f" So far {ran} of {extremes.trials} have run." * (ran < extremes.trials)
    tone = MET if met == ran else "strong" if met else NOT_MET
    return text(Word(meets, tone), ".", *_point(extremes, "Best", extremes.best),
                *_point(extremes, "Worst", extremes.worst), rest or None)  # fmt: skip


def _point(extremes: Extremes, superlative: str, point: Point | None) -> Parts:
    if point is None or extremes.ran < 2:
        return ()
    value = Number(point.value, extremes.responses[point.response].scale)
    return say(
        f" {superlative}: {point.at}, where {{}} is {{}}.", Name(point.response), value
    )


def _limits(extremes: Extremes) -> Table:
    """Return in how many trials each limit is met, its worst value, and where."""
    run, ran, rows = extremes.stored_run, extremes.ran, list[dict[str, Given]]()
    by_misses = sorted(
        extremes.responses.items(), key=lambda item: -item[1].trials_out_of_limit
    )
    for name, response in by_misses:
        ends = [end for end in (response.least, response.largest) if end]
        if response.limit is None or not ends:
            continue
        limit = response.limit.permitted
        worst = min(ends, key=lambda end: margins(np.array(end.value), limit))
        trial = worst.trial
        rows.append({
            "response": Name(name),
            "limit": Word(response.limit.words, "limit"),
            "met in": f"{ran - response.trials_out_of_limit} of {ran}",
            "worst value": with_unit(Number(worst.value, response.scale)),
            "at": "all" if trial is None else point_words(run, trial),
        })  # fmt: skip
    return table_of(rows, "Limits", words=["at"], look="verdicts")


def _responses(extremes: Extremes) -> Table:
    rows: list[dict[str, Given]] = [
        {
            "response": Name(name),
            "unit": response.scale.mark,
            "nominal": Number(response.nominal, response.scale),
            **_extreme("least", response.least, response.scale),
            **_extreme("largest", response.largest, response.scale),
        }
        for name, response in extremes.responses.items()
    ]
    return table_of(rows, keys=2, look="dense", spare=["nominal"])


def _extreme(head: str, extreme: Extreme | None, scale: Scale) -> dict[str, Given]:
    if extreme is None:
        return {head: "failed"}
    trial = "all" if extreme.trial is None else Number(extreme.trial)
    return {head: Number(extreme.value, scale), f"{head} in trial": trial}


def table_rows(run: Run) -> list[blocks.Block]:
    """Return the trials of a table: their deviations, responses and statuses.

    A row has the deviations that differ between trials, the limited responses (or the
    first ones), the status and the limits it is out of. Common deviations follow. Empty
    unless the run has sampling = "table".
    """
    if run.sampling != "table":
        return []
    deviations = {part.name: run.column(part.name) for part in run.contributors}
    same = [n for n, x in deviations.items() if run.trials > 1 and not np.ptp(x)]
    moved = [n for n, x in deviations.items() if n not in same and np.any(x)]
    focus, names = responses_in_focus(run), [x.name for x in run.responses]
    columns = [*moved, *(name for name in names if name in focus)]
    done = run.status == Status.DONE
    out_of = {n: run.beyond(n) & done for n in names if n in run.limits}
    rows: list[dict[str, Given]] = []
    for trial in range(min(run.trials, MOST_ROWS)):
        row: dict[str, Given] = {"trial": Number(trial)}
        for name in columns:
            ran = name in deviations or run.status[trial] != Status.NOT_RUN
            head = f"{name}\n{run.scales[name].mark}"
            row[head] = _cell(run, name, trial) if ran else None
        out = ", ".join(name for name, trials in out_of.items() if trials[trial])
        rows.append({**row, "status": run.ended_as(trial), "out of limit": out})
    table = table_of(rows, f"{run.title}: trials", words=["out of limit"])
    parts: list[blocks.Block] = [table]
    if common := [(f"{n} ", _cell(run, n, 0)) for n in same if deviations[n][0]]:
        parts.append(blocks.paragraph("in all trials: ", listed(common, "")))
    if len(rows) < run.trials:
        parts.append(blocks.paragraph(
            f"the first {len(rows)} of ", counted(run.trials, "trial"),
            f'; tolstat.open("{run.path}").frame() has all. One of them: ',
            command("trial", run.path, "NUMBER", machine=run.machine),
        ))  # fmt: skip
    return parts


def _cell(run: Run, name: str, trial: int) -> str | Number:
    value = float(run.column(name)[trial])
    return "failed" if math.isnan(value) else Number(value, run.scales[name])


def comparisons(run: Run) -> Iterator[Table]:
    """Compare a grid run with its reference: a table for each response and curve.

    Points with values on other axes are compared with the curve on which they lie.
    None where a run has no reference.
    """
    if run.reference is None:
        return
    columns, label = run.reference.columns, run.reference.label
    axis, *others = columns
    curves = (
        (response, sweep)
        for response in others
        if response not in run.grid
        for sweep in sweeps(run, axis, response)
    )
    for response, sweep in curves:
        on = np.full(len(columns[axis]), True)
        for name in sweep.same.keys() & columns.keys():
            on &= np.isclose(columns[name], sweep.same[name], rtol=1e-9, atol=0.0)
        if not on.any():
            continue
        along, scale = grid_axis(run, axis), run.scales[response]._replace(least=0.0)
        points, reference = columns[axis][on], columns[response][on]
        values = np.interp(points, sweep.x, sweep.y, left=np.nan, right=np.nan)
        rows = [
            {
                along.scale.label(along.title): Number(x, along.scale),
                "reference": Number(a, scale),
                "run": Number(b, scale),
                "difference": Number(b - a, scale),
            }
            for x, a, b in np.transpose([points, reference, values]).tolist()
        ]
        title = f"{scale.label(response)}: {label}"
        title += f" ({sweep.label})" * bool(sweep.label)
        exact = np.isin(points, sweep.x).all()
        caption = text(None if exact else "between points: linear")
        yield table_of(rows, title, caption=caption)
