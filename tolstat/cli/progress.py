"""The progress bar of all that evaluates trials, and how such a command ends."""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import NoReturn

from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Task,
    TextColumn,
    TimeRemainingColumn,
)
from rich.progress import Progress as Bar
from rich.text import Text

from tolstat.answers.next_steps import to_resume
from tolstat.answers.report.gather import summary
from tolstat.answers.sweep.table_rows import comparisons
from tolstat.cli.interrupting import INTERRUPTED, LIMITS_NOT_MET, stop_on_interrupt
from tolstat.cli.options import Compute
from tolstat.document.blocks import Document
from tolstat.execution.run_loop import Progress
from tolstat.literal import visible
from tolstat.render.screen import Screen, show
from tolstat.store.stored_run import Run

AFTERWARDS = {"audit": "evaluating the audit", "diagnostics": "slopes and worst cases"}


class _Rate(TextColumn):
    """Trials per second."""

    def __init__(self) -> None:
        super().__init__("")

    def render(self, task: Task) -> Text:
        speed = task.finished_speed or task.speed
        return Text(f"{speed:.0f} trials/s" if speed else "", style="cyan")


class ProgressBar(Bar):
    """A bar on the standard error, and notes above it.

    Parameters
    ----------
    title : str
        What is evaluated.
    """

    def __init__(self, title: str) -> None:
        super().__init__(
            TextColumn("{task.description}", markup=False),
            BarColumn(),
            MofNCompleteColumn(),
            _Rate(),
            TimeRemainingColumn(),
            TextColumn("{task.fields[failed]}"),
            console=Screen(stderr=True),
            transient=True,
        )
        self._named = {"trials": visible(title), **AFTERWARDS}
        self._task = self.add_task("compiling, if need be", total=None, failed="")

    def tell(self, progress: Progress) -> None:
        """Show how far it is."""
        for each in notes_of(progress):
            self.print(f"note: {each}", soft_wrap=True)
        if progress.doubt:
            return
        total, doing = progress.asked or None, progress.doing
        if self.tasks[0].total is None:
            self.reset(self._task, total=total)
        self.update(
            self._task, total=total, completed=progress.over,
            description=self._named.get(doing, doing),
            failed=f"{progress.failed} failed",
        )  # fmt: skip


def notes_of(progress: Progress) -> Iterator[str]:
    """Say what has to be known while trials are evaluated."""
    if progress.doubt:
        yield progress.doubt
    elif progress.wanted:
        yield _out_of_reach(progress)


def _out_of_reach(progress: Progress) -> str:
    """Say that a stopping rule wants more trials than it may have."""
    rules, wanted = "; ".join(progress.rules), progress.wanted
    if math.isinf(wanted):
        return f"{rules}: the first look cannot tell yet how many trials that takes"
    more = f"{float(f'{wanted:.2g}'):,.0f}".replace(",", " ")
    return (
        f"{rules}: as far as the first look can tell, that takes about {more} trials; "
        f"at_most = {progress.at_most} will hardly do"
    )


def watch(path: Path, compute: Compute, work: Callable[..., Run]) -> None:
    """Let a run be worked on, show how it goes, then its summary; end the command."""
    console = Screen(stderr=True)
    with stop_on_interrupt() as stop:
        with ProgressBar(path.stem) as bar, compute.crew(stop.is_set) as crew:
            done = work(crew, progress=bar.tell)
        if not done.complete:
            _say_how_to_resume(done, console)
        found = summary(done)
        show(found.document())
        show(Document("", tuple(comparisons(done))))
    seconds = done.provenance["seconds"]
    rate = f"{done.trials / seconds:.0f} trials/s"
    stored = f"stored in {done.path}"
    console.print(f"{done.trials} trials in {seconds:.1f} s ({rate}), {stored}")
    if found.not_met:
        sys.exit(LIMITS_NOT_MET)


def _say_how_to_resume(run: Run, console: Screen) -> NoReturn:
    with suppress(OSError):  # the terminal may be gone
        console.print(
            f"stopped: {run.ended} of {run.trials} trials are stored in {run.path}; "
            "continue with:",
            soft_wrap=True,
        )
        console.print(to_resume(run.path, run.machine), soft_wrap=True)
    leave_interrupted()


def leave_interrupted() -> NoReturn:
    """End the process: a compilation under way would hold up `sys.exit`."""
    with suppress(OSError):
        sys.stdout.flush()
        sys.stderr.flush()
    os._exit(INTERRUPTED)
