"""A queue of studies on the screen: one table while it works, an index at the end."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from rich.live import Live
from rich.table import Table

from tolstat.answers import pages as making
from tolstat.answers.index.run_entries import (
    HEADS,
    Entry,
    entry_of,
    index_csv,
    index_page,
)
from tolstat.answers.report.ask import report
from tolstat.cli.interrupting import INTERRUPTED, LIMITS_NOT_MET, stop_on_interrupt
from tolstat.cli.listing import FIRST, row_of, runs_table
from tolstat.cli.power import Power
from tolstat.cli.running import AFTERWARDS, out_of_reach
from tolstat.cli.showing import Screen, print_words
from tolstat.errors import PictureError, RunFileError, StoppedError, TolstatError
from tolstat.execution.execute import run_of
from tolstat.execution.run_loop import Progress
from tolstat.execution.study_queue import work_off
from tolstat.execution.workers.crew import Workers
from tolstat.render.output_file import check_folder
from tolstat.render.plain import csv_text
from tolstat.store.stored_run import Run

WAITING, RUNNING, STOPPED, FAILED = "waiting", "running", "stopped", "failed"
TITLE = "tolstat batch"


@dataclass
class Queue:
    """Studies in their order, and what has become of them."""

    entries: dict[Path, Entry]  # by study file
    exit_codes: set[int] = field(default_factory=set)  # of studies that failed
    began: float = 0.0  # when the present study did, s

    def table(self) -> Table:
        """Return all of them as they stand."""
        table = runs_table(*FIRST)
        for each in self.entries.values():
            table.add_row(*row_of(each))
        return table

    @property
    def exit_code(self) -> int:
        """What the worst of them ends with: broken, wrong, not met, done."""
        not_met = any(each.not_met for each in self.entries.values())
        return min(self.exit_codes or {LIMITS_NOT_MET if not_met else 0})


def work_off_all(studies: Sequence[Path], folder: Path | None, power: Power) -> int:
    """Run what is missing of each study, one after the other; write the index.

    Runs and reports lie beside their studies, the index in the folder, or in the one
    that the studies share. Returns the exit code.
    """
    files = list({path.resolve(): path for path in studies}.values())
    index = _index_in(folder, files)
    queue = Queue({each: Entry(each.stem, state=WAITING) for each in files})
    screen = Screen(stderr=True)
    with stop_on_interrupt() as stop:
        with (
            Live(console=screen, get_renderable=queue.table, transient=True) as live,
            power.crew(stop.is_set) as crew,
        ):
            for study in files:
                if not stop.is_set():
                    _work_off(study, queue, crew, live)
                    _write_index(queue, index)
        print_words(queue.table())
        for each in queue.entries.values():
            if each.problem:
                screen.print(f"{each.study}: {each.problem}", soft_wrap=True)
        screen.print(f"index in {index} and {index.with_suffix('.csv')}")
        if stop.is_set():
            screen.print("stopped; the same command goes on")
            with suppress(OSError):
                sys.stdout.flush()
            os._exit(INTERRUPTED)  # a compilation under way would hold up sys.exit
    return queue.exit_code


def _work_off(study: Path, queue: Queue, crew: Workers, live: Live) -> None:
    """Work off one study; what fails of it stops no other."""
    queue.began = time.monotonic()

    def note(text: str) -> None:
        live.console.print(f"note: {study}: {text}", soft_wrap=True)

    def tell(progress: Progress) -> None:
        if progress.doubt:
            note(progress.doubt)
            return
        if progress.wanted:
            note(out_of_reach(progress))
        doing = AFTERWARDS.get(progress.doing, RUNNING)
        queue.entries[study] = queue.entries[study]._replace(
            state=doing, trials=progress.asked, ended=progress.over,
            failed=progress.failed, seconds=time.monotonic() - queue.began,
        )  # fmt: skip

    queue.entries[study] = Entry(study.stem, state=RUNNING)
    try:
        run, how, notes = work_off(study, crew, tell)
        for each in notes:
            note(each)
        entry = entry_of(run)._replace(study=study.stem)
        if not run.complete:
            queue.entries[study] = entry._replace(state=STOPPED)
            return
        queue.entries[study] = entry._replace(state=how)
        queue.entries[study] = entry._replace(state=how, report=_report(run))
    except StoppedError:
        queue.entries[study] = queue.entries[study]._replace(state=STOPPED)
    except (TolstatError, MemoryError) as error:
        problem = str(error) or "there is not enough memory for this"
        found = queue.entries[study]
        queue.entries[study] = found._replace(state=FAILED, problem=problem)
        queue.exit_codes.add(getattr(error, "exit_code", 1))


def _report(run: Run) -> Path | None:
    """Write the report of a run, unless it is there; None where it can have none."""
    page = run.path.with_suffix(".html")
    with suppress(OSError):
        if page.stat().st_mtime >= run.path.stat().st_mtime:
            return page
    try:
        return report(run).save(page)
    except PictureError:  # machines that were chosen and not drawn
        return None


def _index_in(folder: Path | None, files: Sequence[Path]) -> Path:
    """Name the page of the index; refuse to replace what is none."""
    shared = os.path.commonpath([path.absolute().parent for path in files])
    folder = folder or Path(shared)
    with suppress(ValueError):
        folder = folder.relative_to(Path.cwd())
    page = folder / "batch.html"
    check_folder(page)
    taken = {run_of(each).with_suffix(".html").resolve() for each in files}
    marks = {page: f"<title>{TITLE}", page.with_suffix(".csv"): csv_text(HEADS, ())}
    for path, mark in marks.items():
        known = not os.path.lexists(path) or _begins_with(path, mark)
        if path.resolve() in taken or not known:
            raise RunFileError(
                f"{path} is no index of a batch, and is not replaced; name another "
                "folder (-o)"
            )
    return page


def _begins_with(path: Path, mark: str) -> bool:
    try:
        with path.open("rb") as file:
            return path.is_file() and mark.encode() in file.read(1000)
    except OSError:
        return False


def _write_index(queue: Queue, page: Path) -> None:
    entries, folder = list(queue.entries.values()), page.parent
    making.write(page, index_page(entries, folder, TITLE))
    making.write(page.with_suffix(".csv"), index_csv(entries, folder))
