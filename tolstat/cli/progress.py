"""The progress bar of commands that evaluate trials, and how they end."""

import math
import sys
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

from rich import progress as bars

from tolstat.answers.next_steps import to_resume
from tolstat.answers.report.gather import summary
from tolstat.cli.entry import leave_interrupted, stop_on_interrupt
from tolstat.cli.options import Compute
from tolstat.execution.run_loop import Progress
from tolstat.literal import visible
from tolstat.render.screen import Screen, show
from tolstat.store.stored_run import Run

AFTERWARDS = {"audit": "evaluating the audit", "diagnostics": "slopes and worst cases"}


class ProgressBar(bars.Progress):
    """A bar on the standard error, titled by what is evaluated, and notes above it."""

    def __init__(self, title: str) -> None:
        self._screen = Screen(stderr=True)
        super().__init__(
            bars.TextColumn("{task.description}", markup=False),
            bars.BarColumn(),
            bars.MofNCompleteColumn(),
            bars.TextColumn("{task.fields[rate]}", style="cyan"),
            bars.TimeRemainingColumn(),
            bars.TextColumn("{task.fields[failed]}"),
            console=self._screen,
            transient=True,
        )
        self._named = {"trials": visible(title), **AFTERWARDS}
        start = "starting; new code is compiled first"
        self._task = self.add_task(start, total=None, rate="", failed="")

    def tell(self, progress: Progress) -> None:
        """Show the progress."""
        for sentence in notes_of(progress):
            self._screen.say(f"note: {sentence}")
        if progress.warning:
            return
        task, total = self.tasks[0], progress.asked or None
        if task.total is None:
            self.reset(self._task, total=total)
        speed = task.finished_speed or task.speed
        self.update(
            self._task, total=total, completed=progress.over,
            description=self._named.get(progress.doing, progress.doing),
            rate=f"{speed:.0f} trials/s" if speed else "",
            failed=f"{progress.failed} failed",
        )  # fmt: skip


def notes_of(progress: Progress) -> Iterator[str]:
    """Yield the notes to show while trials are evaluated."""
    if progress.warning:
        yield progress.warning
    elif needed := progress.wanted:  # more trials than the stopping rule permits
        rules = "; ".join(progress.rules)
        if math.isinf(needed):
            yield f"{rules}: too early to estimate the trials needed"
            return
        more = f"{float(f'{needed:.2g}'):,.0f}".replace(",", " ")
        yield (
            f"{rules}: about {more} trials are needed (first estimate); at_most = "
            f"{progress.at_most} is probably too small"
        )


def watch(
    path: Path, compute: Compute, work: Callable[..., Run], *, check: bool = False
) -> None:
    """Work on a run, show its progress and its summary; with `check` end as that."""
    console = Screen(stderr=True)
    with stop_on_interrupt() as stop:
        with ProgressBar(path.stem) as bar, compute.crew(stop.is_set) as crew:
            done = work(crew, progress=bar.tell)
        if not done.complete:
            with suppress(OSError):  # the terminal may be gone
                stored = f"{done.ended} of {done.trials} trials are stored"
                words = f"stopped: {stored} in {done.path}; continue with:"
                console.say(words)
                console.type(to_resume(done.path, done.machine))
            leave_interrupted()
        show(summary(done).document())
    seconds = done.provenance["seconds"]
    rate = f"{done.trials / seconds:.0f} trials/s"
    stored = f"stored in {done.path}"
    console.say(f"{done.trials} trials in {seconds:.1f} s ({rate}), {stored}")
    if check:
        from tolstat.cli.check import checked

        sys.exit(checked([done]).exit_code)
