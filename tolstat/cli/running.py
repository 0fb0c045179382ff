"""A run on the screen: progress, Ctrl-C, the table at the end."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Event
from types import FrameType

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    Task,
    TextColumn,
    TimeRemainingColumn,
)
from rich.text import Text

from tolstat.cli.showing import print_comparisons, print_summary
from tolstat.study.run import execute
from tolstat.study.study import Study

INTERRUPTED = 130


class _Rate(TextColumn):
    """Trials per second."""

    def __init__(self) -> None:
        super().__init__("")

    def render(self, task: Task) -> Text:
        speed = task.finished_speed or task.speed
        return Text(f"{speed:.0f} trials/s" if speed else "", style="cyan")


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
    screen = Console(stderr=True)
    bar = Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        _Rate(),
        TimeRemainingColumn(),
        TextColumn("{task.fields[failed]}"),
        console=screen,
        transient=True,
    )
    with stop_on_interrupt() as stop, bar:
        task = bar.add_task("compiling, if need be", total=None, failed="")

        def progress(over: int, failed: int, asked: int) -> None:
            if bar.tasks[task].total is None:
                bar.reset(task, total=asked, description=study.path.stem)
            words = f"[red]{failed} failed" if failed else "0 failed"
            bar.update(task, total=asked, completed=over, failed=words)

        done = execute(
            study, path, workers=workers, force=force, progress=progress,
            stopping=stop.is_set,
        )  # fmt: skip
    if stop.is_set():
        ended = done.trials - done.counts["not run"]
        screen.print(f"stopped: {ended} of {done.trials} trials are stored in {path}")
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(INTERRUPTED)  # a compilation under way would hold up sys.exit
    print_summary(done)
    print_comparisons(done)
    seconds = done.facts["seconds"]
    rate = f"{done.trials / seconds:.0f} trials/s"
    screen.print(f"{done.trials} trials in {seconds:.1f} s ({rate}), stored in {path}")


@contextmanager
def leave_on_interrupt() -> Iterator[None]:
    """End the process at the first Ctrl-C, whatever its threads still compute."""
    before = signal.getsignal(signal.SIGINT)

    def interrupt(number: int, frame: FrameType | None) -> None:
        sys.stderr.write("stopped: nothing is written\n")
        sys.stderr.flush()
        os._exit(INTERRUPTED)

    signal.signal(signal.SIGINT, interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


@contextmanager
def stop_on_interrupt() -> Iterator[Event]:
    """Let the first Ctrl-C set an event; a second one ends the process at once.

    Yields
    ------
    Event
        Set once the user wants to stop.
    """
    stop = Event()
    before = signal.getsignal(signal.SIGINT)

    def interrupt(number: int, frame: FrameType | None) -> None:
        if stop.is_set():
            os._exit(INTERRUPTED)
        stop.set()

    signal.signal(signal.SIGINT, interrupt)
    try:
        yield stop
    finally:
        signal.signal(signal.SIGINT, before)
