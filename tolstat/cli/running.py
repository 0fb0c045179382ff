"""A run on the screen: progress, the table at the end."""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Callable
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

from tolstat.cli.interrupting import INTERRUPTED, stop_on_interrupt
from tolstat.cli.power import Power
from tolstat.cli.showing import Screen, print_comparisons, print_summary
from tolstat.execution.continuation import go_on
from tolstat.execution.execute import execute
from tolstat.execution.run_loop import Progress, Telling
from tolstat.execution.workers.crew import Workers
from tolstat.literal import visible
from tolstat.store.commands import to_resume
from tolstat.store.stored_run import Run
from tolstat.study.study import Study

AFTERWARDS = {"audit": "evaluating the audit", "diagnostics": "slopes and worst cases"}


class _Rate(TextColumn):
    """Trials per second."""

    def __init__(self) -> None:
        super().__init__("")

    def render(self, task: Task) -> Text:
        speed = task.finished_speed or task.speed
        return Text(f"{speed:.0f} trials/s" if speed else "", style="cyan")


def out_of_reach(progress: Progress) -> str:
    """Say that a stopping rule asks for more trials than it may have."""
    rules, wanted = "; ".join(progress.rules), progress.wanted
    if math.isinf(wanted):
        return f"{rules}: the first look cannot tell yet how many trials that takes"
    more = f"{float(f'{wanted:.2g}'):,.0f}".replace(",", " ")
    return (
        f"{rules}: as far as the first look can tell, that takes about {more} trials; "
        f"at_most = {progress.at_most} will hardly do"
    )


def run_study(study: Study, path: Path, power: Power, *, force: bool) -> bool:
    """Run a study, show how it goes, print its summary; false if a limit is not met."""
    for doubt in study.doubts:
        Screen(stderr=True).print(f"note: {doubt}", soft_wrap=True)

    def work(crew: Workers, tell: Telling) -> Run:
        return execute(study, path, crew, force=force, progress=tell)

    return _watched(path, power, work)


def go_on_with(
    path: Path,
    power: Power,
    *,
    trials: int | None = None,
    rerun: bool = False,
    regardless: bool = False,
) -> bool:
    """Go on with a run as `tolstat.resume` or `extend`; false if a limit is not met."""

    def work(crew: Workers, tell: Telling) -> Run:
        return go_on(
            path, crew, trials=trials, rerun=rerun, regardless=regardless, progress=tell
        )

    return _watched(path, power, work)


def _watched(path: Path, power: Power, work: Callable[[Workers, Telling], Run]) -> bool:
    """Let a run be worked on, and show how it goes and what it says."""
    screen = Screen(stderr=True)
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
    with stop_on_interrupt() as stop:
        with bar, power.crew(stop.is_set) as crew:
            task = bar.add_task("compiling, if need be", total=None, failed="")

            def tell(progress: Progress) -> None:
                if progress.doubt:
                    bar.print(f"note: {progress.doubt}", soft_wrap=True)
                    return
                if progress.wanted:
                    bar.print(out_of_reach(progress))
                if bar.tasks[task].total is None:
                    bar.reset(
                        task, total=progress.asked, description=visible(path.stem)
                    )
                if progress.doing in AFTERWARDS:
                    bar.update(task, description=AFTERWARDS[progress.doing])
                bar.update(
                    task, total=progress.asked, completed=progress.over,
                    failed=f"{progress.failed} failed",
                )  # fmt: skip

            done = work(crew, tell)
        if not done.complete:
            _say_how_to_go_on(done, screen)
        met = print_summary(done)
        print_comparisons(done)
    seconds = done.provenance["seconds"]
    rate = f"{done.trials / seconds:.0f} trials/s"
    stored = f"stored in {done.path}"
    screen.print(f"{done.trials} trials in {seconds:.1f} s ({rate}), {stored}")
    return met


def _say_how_to_go_on(run: Run, screen: Screen) -> NoReturn:
    """Say what is stored and how it is gone on with; end the process."""
    with suppress(OSError):  # the terminal may be gone
        screen.print(
            f"stopped: {run.ended} of {run.trials} trials are stored in {run.path}; go "
            "on with:",
            soft_wrap=True,
        )
        screen.print(to_resume(run.path, run.machine), soft_wrap=True)
        sys.stdout.flush()
        sys.stderr.flush()
    os._exit(INTERRUPTED)  # a compilation under way would hold up sys.exit
