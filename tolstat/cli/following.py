"""A run looked on at while another process writes it."""

from __future__ import annotations

import sys
import time
from pathlib import Path

from rich.live import Live
from rich.table import Table

from tolstat.cli.interrupting import INTERRUPTED, stop_on_interrupt
from tolstat.cli.listing import row_of, runs_table
from tolstat.cli.showing import Screen
from tolstat.reporting.listing import entry_of
from tolstat.store.advice import to_resume
from tolstat.store.lock import writer_of
from tolstat.store.opening import open as open_run
from tolstat.store.run import Run

LOOK_AGAIN = 1.0  # s, between two looks
SHARE = 5.0  # times as long as a look takes, at least


def follow_run(path: Path) -> None:
    """Show how far a run is, until it is complete or nobody writes it any more."""
    screen = Screen(stderr=True)
    with stop_on_interrupt() as stop, Live(console=screen, transient=True) as live:
        before: tuple[float, int] | None = None
        while True:
            began = time.monotonic()
            writer = writer_of(path)  # first: what it writes before it ends is seen
            run = open_run(path)
            live.update(_state(run, began, before))
            if run.complete or not writer:
                break
            before = before or (began, run.ended)
            if stop.wait(max(LOOK_AGAIN, SHARE * (time.monotonic() - began))):
                sys.exit(INTERRUPTED)
    if not run.complete:
        screen.print(
            f"nobody writes {path}: {run.ended} of {run.trials} trials have run; go on "
            f"with: {to_resume(path, run.machine)}",
            soft_wrap=True,
        )


def _state(run: Run, now: float, before: tuple[float, int] | None) -> Table:
    table = runs_table("trials/s")
    speed = (run.ended - before[1]) / (now - before[0]) if before else 0.0
    table.add_row(*row_of(entry_of(run)), f"{speed:.0f}" if speed else "")
    return table
