"""One machine on the screen: its deviations, its responses, how it moved."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from tolstat.answers.pages import check_view_ending, save_view
from tolstat.answers.views.replay import replay
from tolstat.answers.views.trajectory import STEP
from tolstat.cli.showing import print_words, screen, words_table
from tolstat.errors import ModelError, RunFileError
from tolstat.model.checked import history_of, simulate
from tolstat.model.contract import Answers
from tolstat.model.description import Contributor, Response
from tolstat.model.view import View
from tolstat.statistics.limits.limit import Limit
from tolstat.status import Status, words_of
from tolstat.store.commands import to_resume
from tolstat.store.open_run import open as open_run
from tolstat.study.study import load
from tolstat.units.scale import Scale, scale_of


def show_trial(path: Path, index: int | None, picture: Path | None) -> bool:
    """Show a trial (None: the nominal machine) anew; tell whether it is as stored."""
    if picture:
        check_view_ending(picture)
    run = open_run(path, damaged=True)
    ran = index is None or run.status[index : index + 1] != Status.NOT_RUN
    if not np.all(ran):
        raise RunFileError(f"{path}: trial {index} has not run")
    found = replay(run, index)
    name = "the nominal machine" if index is None else f"trial {index}"
    title = f"{run.title}: {name}"
    console = screen()
    console.print(f"{title}: {_ended(found.word, found.outcome)}", style="bold")
    for swept in run.swept if index is not None else ():
        setting = swept.name
        value, scale = run.column(setting)[index].item(), run.scales[setting]
        console.print(
            f"{setting}: {value if isinstance(value, str) else scale.words(value)}"
        )
    _print_deviations(run.contributors, found.deviations, run.scales)
    _print_responses(run.responses, found.outcome, run.limits, run.scales)
    if found.differences:
        reason = f": {found.reason}" if found.reason else ""
        listed = ", ".join(found.differences)
        console.print(f"not bit for bit as stored{reason}; different: {listed}")
    else:
        console.print("bit for bit as stored")
    if run.damage:
        advice = to_resume(path, run.machine)
        console.print(
            f"the run is damaged: {run.damage.words}; `{advice}` repairs it",
            soft_wrap=True,
        )
    if picture:
        if found.history is None:
            raise ModelError(f"model '{run.model}' does not move: it has no histories")
        _draw(found.history, title, picture)
    return not found.differences


def show_nominal(path: Path, picture: Path | None) -> None:
    """Show the machine without deviations of a study."""
    if picture:
        check_view_ending(picture)
    study = load(path)
    contributors, responses = study.description
    nominal = np.zeros(len(contributors))
    title = f"{study.title}: the nominal machine"
    if picture:
        chart, outcome = history_of(study.model, nominal, study.settings, STEP)
        _draw(chart, title, picture)
    else:
        outcome = simulate(study.model, nominal[None, :], study.settings)
    word = words_of(study.model.failures)[int(outcome.status[0])]
    screen().print(f"{title}: {_ended(word, outcome)}", style="bold")
    scales = {
        each.name: scale_of(
            each.unit, study.shown.get(each.name) or each.shown, abs(float(value))
        ).telling(
            0.0, study.limits[each.name].asked if each.name in study.limits else ()
        )
        for each, value in zip(responses, outcome.responses[0], strict=True)
    }
    _print_responses(responses, outcome, study.limits, scales)


def _draw(view: View, title: str, picture: Path) -> None:
    save_view(view, picture, title)
    screen().print(f"drawn in {picture}")


def _ended(word: str, outcome: Answers) -> str:
    steps = f", {outcome.steps[0]} steps" if outcome.steps is not None else ""
    return f"{word}{steps}"


def _print_deviations(
    contributors: tuple[Contributor, ...],
    deviations: Mapping[str, float],
    scales: Mapping[str, Scale],
) -> None:
    """Print what deviates."""
    heads = ("contributor", "deviation", "")
    table = words_table("", *heads, numbers=["deviation"])
    for each in contributors:
        if value := deviations[each.name]:
            words = scales[each.name].words(value)
            table.add_row(each.name, words, each.sentence)
    if table.row_count:
        print_words(table)


def _print_responses(
    responses: tuple[Response, ...],
    outcome: Answers,
    limits: Mapping[str, Limit],
    scales: Mapping[str, Scale],
) -> None:
    """Print the responses, and which limits they pass."""
    table = words_table("", "response", "value", "limit", numbers=["value"])
    for each, value in zip(responses, outcome.responses[0].tolist(), strict=True):
        words = ""
        if limit := limits.get(each.name):
            within = limit.lower <= value <= limit.upper
            words = limit.words + ("" if within else ": beyond")
        table.add_row(each.name, scales[each.name].words(value), words)
    print_words(table)
