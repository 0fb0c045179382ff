"""The progress bar of commands that evaluate trials, and notes on the way."""

import math
from collections.abc import Iterator

from rich import progress as bars

from tolstat.execution.run_loop import Progress
from tolstat.literal import visible
from tolstat.render.screen import Screen

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
