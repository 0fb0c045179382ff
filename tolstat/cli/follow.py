"""A run followed while another process writes it."""

from __future__ import annotations

import sys
import time
from contextlib import nullcontext
from pathlib import Path

from rich.live import Live
from rich.table import Table

from tolstat.answers.index.run_entries import RunIndex, entry_of
from tolstat.answers.next_steps import to_resume
from tolstat.cli.interrupting import INTERRUPTED, stop_on_interrupt
from tolstat.render.screen import Screen, as_rich
from tolstat.store.lock import writer_of
from tolstat.store.open_run import open as open_run
from tolstat.store.stored_run import Run

LOOK_AGAIN = 1.0  # s, between two looks
SHARE = 5.0  # times as long as a look takes, at least


def follow_run(path: Path) -> None:
    """Show how far a run is, until it is complete or nobody writes it any more."""
    screen, said = Screen(stderr=True), ""
    shown = Live(console=screen, transient=True) if screen.is_terminal else None
    with stop_on_interrupt() as stop, shown or nullcontext():
        before: tuple[float, int] | None = None
        while True:
            began = time.monotonic()
            writer = writer_of(path)  # first: what it writes before it ends is seen
            run = open_run(path)
            if shown:
                shown.update(_state(run, began, before))
            elif (line := _in_line(run)) != said:
                screen.print(said := line, soft_wrap=True)
            if run.complete or not writer:
                break
            before = before or (began, run.ended)
            if stop.wait(max(LOOK_AGAIN, SHARE * (time.monotonic() - began))):
                sys.exit(INTERRUPTED)
    if not run.complete:
        screen.print(
            f"nothing writes {path}: {run.ended} of {run.trials} trials have run; "
            f"continue it with: {to_resume(path, run.machine)}",
            soft_wrap=True,
        )


def _in_line(run: Run) -> str:
    """Say how far a run is where no table can be drawn again."""
    failed = "" if run.aim else f", {run.failed} failed"
    return f"{run.path}: {run.ended} of {run.trials} trials{failed}"


def _state(run: Run, now: float, before: tuple[float, int] | None) -> Table:
    table = as_rich(RunIndex("", run.path.parent, (entry_of(run),)).progress())
    if before:
        table.caption = f"{(run.ended - before[1]) / (now - before[0]):.0f} trials/s"
    return table
