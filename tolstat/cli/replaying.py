"""One machine on the screen: its deviations, its responses, how it moved."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from rich import box
from rich.table import Table

from tolstat.cli.showing import screen
from tolstat.errors import ModelError, RunFileError
from tolstat.machines.description import Contributor, History, Outcome, Response
from tolstat.report.numbers import in_engineering_unit, limit_in_words
from tolstat.status import WORDS, Status
from tolstat.store.run import open as open_run
from tolstat.study.evaluate import simulate
from tolstat.study.replay import replay
from tolstat.study.study import load
from tolstat.study.trajectory import history_of
from tolstat.units.conversion import engineering_unit

Limits = Mapping[str, tuple[float, float]]


def show_trial(path: Path, index: int | None, picture: Path | None) -> bool:
    """Show one trial of a run, simulated again.

    Parameters
    ----------
    path : Path
        The run.
    index : int or None
        Number of the trial; None for the nominal machine.
    picture : Path, optional
        Where to draw its histories.

    Returns
    -------
    bool
        Whether it is bit for bit as stored.
    """
    _check(picture)
    run = open_run(path)
    ran = index is None or run.status[index : index + 1] != Status.NOT_RUN
    if not np.all(ran):
        raise RunFileError(f"{path}: trial {index} has not run")
    found = replay(run, index)
    name = "the nominal machine" if index is None else f"trial {index}"
    title = f"{run.facts['title']}: {name}"
    console = screen()
    console.print(f"{title}: {_status(found.outcome)}", style="bold")
    for setting, unit in run.settings.items() if index is not None else ():
        value = run.column(setting)[index].item()
        words = value if isinstance(value, str) else _quantity(value, unit)
        console.print(f"{setting}: {words}")
    _print_deviations(run.contributors, found.deviations)
    _print_responses(run.responses, found.outcome, run.limits)
    if found.differences:
        reason = f": {found.reason}" if found.reason else ""
        listed = ", ".join(found.differences)
        console.print(f"not bit for bit as stored{reason}; different: {listed}")
    else:
        console.print("bit for bit as stored")
    if picture:
        if found.history is None:
            raise ModelError(f"model '{run.facts['model']}' does not move")
        _draw(found.history, title, picture)
    return not found.differences


def show_nominal(path: Path, picture: Path | None) -> None:
    """Show the machine without deviations of a study."""
    _check(picture)
    study = load(path)
    contributors, responses = study.description
    nominal = np.zeros(len(contributors))
    title = f"{study.title}: the nominal machine"
    if picture:
        history = history_of(study.model, nominal, study.settings)
        outcome = history.outcome
        _draw(history, title, picture)
    else:
        outcome = simulate(study.model, nominal[None, :], study.settings)
    screen().print(f"{title}: {_status(outcome)}", style="bold")
    limits = {name: limit.permitted for name, limit in study.limits.items()}
    _print_responses(responses, outcome, limits)


def _check(picture: Path | None) -> None:
    if picture:
        from tolstat.report.picture import check_ending

        check_ending(picture)


def _draw(history: History, title: str, picture: Path) -> None:
    from tolstat.report.history_picture import draw_history
    from tolstat.report.picture import write

    write(draw_history(history, title), picture)
    screen().print(f"drawn in {picture}")


def _status(outcome: Outcome) -> str:
    steps = f", {outcome.steps[0]} steps" if outcome.steps is not None else ""
    return f"{WORDS[int(outcome.status[0])]}{steps}"


def _print_deviations(
    contributors: tuple[Contributor, ...], deviations: dict[str, float]
) -> None:
    """Print what deviates."""
    table = Table("contributor", box=box.SIMPLE_HEAD)
    table.add_column("deviation", justify="right")
    table.add_column("")
    for each in contributors:
        value = deviations[each.name]
        if value:
            table.add_row(each.name, _quantity(value, each.unit), each.sentence)
    if table.row_count:
        screen().print(table)


def _print_responses(
    responses: tuple[Response, ...], outcome: Outcome, limits: Limits
) -> None:
    """Print the responses, and which limits they pass."""
    table = Table("response", box=box.SIMPLE_HEAD)
    table.add_column("value", justify="right")
    table.add_column("limit")
    for each, value in zip(responses, outcome.responses[0].tolist(), strict=True):
        words = ""
        if each.name in limits:
            lower, upper = limits[each.name]
            words = limit_in_words(limits[each.name], each.unit)
            words += "" if lower <= value <= upper else ": beyond"
        table.add_row(each.name, _quantity(value, each.unit), words)
    screen().print(table)


def _quantity(value: float, unit: str) -> str:
    return f"{in_engineering_unit(value, unit)} {engineering_unit(unit)}"
