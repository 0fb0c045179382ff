"""A run on the screen: progress, the table at the end."""

from __future__ import annotations

import math
import os
import sys
from pathlib import Path

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Task,
    TextColumn,
    TimeRemainingColumn,
)
from rich.progress import Progress as Bar
from rich.text import Text

from tolstat.cli.interrupting import INTERRUPTED, stop_on_interrupt
from tolstat.cli.showing import print_comparisons, print_summary
from tolstat.execution.execute import Progress, execute
from tolstat.execution.workers import Workers
from tolstat.study.study import Study

AFTERWARDS = {"audit": "evaluating the audit", "evidence": "slopes and worst cases"}


class _Rate(TextColumn):
    """Trials per second."""

    def __init__(self) -> None:
        super().__init__("")

    def render(self, task: Task) -> Text:
        speed = task.finished_speed or task.speed
        return Text(f"{speed:.0f} trials/s" if speed else "", style="cyan")


def _out_of_reach(study: Study, wanted: float) -> str:
    """Say that a stopping rule asks for more trials than it may have."""
    assert study.until
    rules = "; ".join(study.until.rules)
    if math.isinf(wanted):
        return f"{rules}: the first look cannot tell yet how many trials that takes"
    more = f"{float(f'{wanted:.2g}'):,.0f}".replace(",", " ")
    return (
        f"{rules}: as far as the first look can tell, that takes about {more} trials; "
        f"at_most = {study.trials} will hardly do"
    )


def run_study(study: Study, path: Path, *, workers: int | None, force: bool) -> None:
    """Run a study, show how it goes and print its summary.

    Parameters
    ----------
    study : Study
        Checked.
    path : Path
        The run file.
    workers : int, optional
        Threads.
    force : bool
        Whether an existing run file may be replaced.
    """
    screen = Console(stderr=True, markup=False, highlight=False)
    for doubt in study.doubts:
        screen.print(f"note: {doubt}", soft_wrap=True)
    bar = Bar(
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        MofNCompleteColumn(),
        _Rate(),
        TimeRemainingColumn(),
        TextColumn("{task.fields[failed]}"),
        console=screen,
        transient=True,
    )
    with stop_on_interrupt() as stop, bar, Workers(workers, stop.is_set) as crew:
        task = bar.add_task("compiling, if need be", total=None, failed="")

        def tell(progress: Progress) -> None:
            over, failed, asked, doing, wanted = progress
            if wanted:
                bar.print(_out_of_reach(study, wanted))
            if bar.tasks[task].total is None:
                bar.reset(task, total=asked, description=path.stem)
            if doing in AFTERWARDS:
                bar.update(task, description=AFTERWARDS[doing])
            bar.update(task, total=asked, completed=over, failed=f"{failed} failed")

        done = execute(study, path, crew, force=force, progress=tell)
    if stop.is_set():
        stored = f"{done.ended} of {done.trials} trials are stored in {path}"
        screen.print(f"stopped: {stored}")
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(INTERRUPTED)  # a compilation under way would hold up sys.exit
    print_summary(done)
    print_comparisons(done)
    seconds = done.provenance["seconds"]
    rate = f"{done.trials / seconds:.0f} trials/s"
    screen.print(f"{done.trials} trials in {seconds:.1f} s ({rate}), stored in {path}")
