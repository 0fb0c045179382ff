"""Studies run one after the other: one table while they run, an index at the end."""

import os
import sys
import time
from collections import Counter
from collections.abc import Iterable, Sequence
from contextlib import nullcontext, suppress
from dataclasses import dataclass, field
from dataclasses import replace as replace_fields
from pathlib import Path
from typing import Any

import click
from rich.live import Live
from rich.table import Table

from tolstat.answers.index_memory import (
    Memory,
    memory_of,
    page_with_memory,
    with_memory,
)
from tolstat.answers.next_steps import worded
from tolstat.answers.output_file import check_folder, replace
from tolstat.answers.reports import report
from tolstat.answers.run_entries import COLUMNS, Entry, RunIndex, entry_of
from tolstat.answers.runs_document import progress_table
from tolstat.cli import options
from tolstat.cli.check import checked
from tolstat.cli.entry import leave_interrupted, stop_on_interrupt
from tolstat.cli.progress import AFTERWARDS, notes_of
from tolstat.errors import RunFileError, StoppedError, TolstatError
from tolstat.execution.execute import complete, run_of
from tolstat.execution.run_loop import Progress
from tolstat.execution.workers.block_scheduler import Workers
from tolstat.regular_files import opened
from tolstat.render.page import GENERATOR, mark_of
from tolstat.render.screen import Screen, as_rich, show_table
from tolstat.store.files_beside import identity
from tolstat.store.open_run import open as open_run
from tolstat.store.stored_run import Run

WAITING, RUNNING, STOPPED, FAILED = "waiting", "running", "stopped", "failed"
TITLE = "tolstat batch"
MARK = f"<title>{TITLE}"  # of an index
CONTINUES = "stopped; the same command continues"
SELDOM = 20  # times the time that writing the index takes: between two of it
AROUND = 6  # lines of a terminal: head, caption, empty ones
BEFORE = 3  # studies above the one that runs: long words take several lines
HEAD = 10_000  # bytes of a page or a table, in which its mark stands
NOT_REPLACED = (
    "{} is not an index of a batch and is not replaced; name another folder (-o)"
)
HEADS = ",".join(COLUMNS[:5])  # how the table of an index begins


@click.command()
@options.path_argument("studies", "STUDY.toml...", nargs=-1, required=True)
@options.computing
@options.output_option(
    "Folder of batch.html and batch.csv; default: that of the studies.",
    metavar="FOLDER",
)
@options.checking
def batch(
    studies: tuple[Path, ...], crew: options.Crew, output: Path | None, check: bool
) -> None:
    """Run studies one after the other, each on all workers.

    Runs and reports lie beside their studies. Finished studies are skipped, interrupted
    ones are resumed, and a failure does not stop the others. The exit code is the first
    that applies: 1 something broke, 2 a study was refused or, with --check, has no
    limit, then 3 and 4 of --check.
    """
    files = list({os.path.realpath(path): path for path in studies}.values())
    page = _index_in(output, files)
    console = Screen(stderr=True)
    stems = Counter(path.stem for path in files)
    folder = Path(os.path.realpath(page.parent))
    waiting = {
        path: Entry(_name(path, folder) if stems[path.stem] > 1 else path.stem,
                    state=WAITING)
        for path in files
    }  # fmt: skip
    queue = Queue(waiting, page, memory_of(page), console)
    live: Live | nullcontext[None] = nullcontext()
    if console.is_terminal:
        live = Live(console=console, get_renderable=queue.table, transient=True)
    with stop_on_interrupt(CONTINUES) as stop:
        with live, crew(stop.is_set) as workers:
            for study in files:
                if not stop.is_set():
                    queue.begun += 1
                    queue.work_off(study, workers)
                    queue.write_index()
            queue.check_pages()
            queue.write_index(last=True)
        show_table(progress_table(queue.index))
        for entry in queue.entries.values():
            if entry.problem:
                console.say(f"{entry.study}: {entry.problem}")
        if _begins_with(page, MARK):
            console.say(f"index in {page} and {page.with_suffix('.csv')}")
        if stop.is_set():
            console.print(CONTINUES)
            leave_interrupted()
    if check and not queue.exit_codes:
        runs = (entry.run for entry in queue.entries.values() if entry.run)
        queue.exit_codes.add(checked(map(open_run, runs)).exit_code)
    sys.exit(min(queue.exit_codes, default=0))  # the worst: broken, wrong, not met


@dataclass
class Queue:
    """Studies in order, with their states."""

    entries: dict[Path, Entry]  # by study file
    page: Path  # of the index
    memory: Memory  # of the page as it was
    console: Screen
    begun: int = 0  # studies
    exit_codes: set[int] = field(default_factory=set)  # of studies that failed
    written: float = 0.0  # when the index was, s
    took: float = 0.0  # writing it, s

    @property
    def index(self) -> RunIndex:
        """The index of all studies."""
        entries = tuple(self.entries.values())
        index = RunIndex(TITLE, self.page.parent, entries, "study")
        return with_memory(index, self.memory)

    def table(self) -> Table:
        """Return the index for the live display: of many studies the lines that fit."""
        index, lines = self.index, max(1, self.console.height - AROUND)
        before = min(lines // 3, BEFORE)
        first = max(0, min(self.begun - 1 - before, len(self.entries) - lines))
        seen = replace_fields(index, entries=index.entries[first : first + lines])
        table = as_rich(progress_table(seen), self.console.width)
        if len(seen.entries) < len(index.entries):
            table.caption = f"study {self.begun} of {len(self.entries)}"
        return table

    def work_off(self, study: Path, workers: Workers) -> None:
        """Run one study and write its report; a failure stops no other study."""
        began = time.monotonic()

        def note(notes: Iterable[str]) -> None:
            for sentence in notes:
                self.console.say(f"note: {study}: {sentence}")

        def tell(progress: Progress) -> None:
            note(notes_of(progress))
            if not progress.warning:
                self._set(
                    study, state=AFTERWARDS.get(progress.doing, RUNNING),
                    trials=progress.asked, ran=progress.over, failed=progress.failed,
                    seconds=time.monotonic() - began,
                )  # fmt: skip

        self._set(study, state=RUNNING)
        try:
            run, how, notes = complete(study, workers, tell)
            note(notes)
            self.entries[study] = entry_of(run).but(study=self.entries[study].study)
            self._set(study, state=how if run.complete else STOPPED)
            if run.complete:
                self._set(study, report=_report(run))
        except StoppedError:
            self._set(study, state=STOPPED)
        except TolstatError as error:
            self._fail(study, worded(error), error.exit_code)
        except MemoryError:
            self._fail(study, "not enough memory", 1)

    def check_pages(self) -> None:
        """Link no page of another run: a run or its page may have been replaced."""
        for study, entry in self.entries.items():
            page, run = entry.report, entry.run
            if page and run and not _begins_with(page, mark_of(identity(run))):
                self._set(study, report=None)
                self._fail(study, "its run or its page was replaced meanwhile", 1)

    def write_index(self, *, last: bool = False) -> None:
        """Write the index; while studies run no oftener than it costs little."""
        began, entries = time.monotonic(), self.entries.values()
        if not last and began - self.written < SELDOM * self.took:
            return
        if self.page.exists() or any(e.run or e.state == STOPPED for e in entries):
            index = self.index
            try:
                self.page.parent.mkdir(exist_ok=True)
                _check_replaceable(self.page)
                replace(self.page, page_with_memory(index, self.memory).encode())
                replace(self.page.with_suffix(".csv"), index.csv().encode())
            except (OSError, RunFileError) as error:
                if last:  # all studies have run
                    self.console.say(f"tolstat: the index is not written: {error}")
                    self.exit_codes.add(1)
        self.written = time.monotonic()
        self.took = self.written - began

    def _set(self, study: Path, **changes: Any) -> None:
        self.entries[study] = self.entries[study].but(**changes)

    def _fail(self, study: Path, problem: str, exit_code: int) -> None:
        self._set(study, state=FAILED, problem=problem)
        self.exit_codes.add(exit_code)


def _name(study: Path, folder: Path) -> str:
    """Return the name of one of several studies that are called alike."""
    return Path(os.path.relpath(study.with_suffix(""), folder)).as_posix()


def _report(run: Run) -> Path:
    """Return the report of a run, written unless the page is of this very run."""
    page = run.path.with_suffix(".html")
    name = identity(run.path)
    if _begins_with(page, mark_of(name)):
        return page
    if os.path.lexists(page) and not _begins_with(page, GENERATOR):
        raise RunFileError(f"{page} is not a report of tolstat and is not replaced")
    return replace(page, report(run).html(name).encode())


def _index_in(folder: Path | None, files: Sequence[Path]) -> Path:
    """Return the page of the index; refuse to replace any other file."""
    exist = [path for path in files if path.is_file()]  # others are refused later
    shared = os.path.commonpath([path.absolute().parent for path in exist or files])
    folder = folder or Path(shared)
    with suppress(ValueError):
        folder = folder.relative_to(Path.cwd())
    page = folder / "batch.html"
    check_folder(folder)
    if os.path.lexists(folder) and not folder.is_dir():  # also a link to nothing
        raise RunFileError(f"{folder} is no folder; name another for the index (-o)")
    _check_replaceable(page)
    pages = {os.path.realpath(run_of(study).with_suffix(".html")) for study in files}
    if os.path.realpath(page) in pages:
        raise RunFileError(NOT_REPLACED.format(page))
    return page


def _check_replaceable(page: Path) -> None:
    """Refuse an index page, and its table, that are anything else."""
    for path, mark in ((page, MARK), (page.with_suffix(".csv"), HEADS)):
        if os.path.lexists(path) and not _begins_with(path, mark):
            raise RunFileError(NOT_REPLACED.format(path))


def _begins_with(path: Path, mark: str) -> bool:
    with suppress(OSError), opened(path) as file:
        return mark.encode() in file.read(HEAD)
    return False
