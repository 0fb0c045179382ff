"""Stored runs as a table: a row for each."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from tolstat.answers.answer import Answer
from tolstat.answers.cells import NONE
from tolstat.answers.report.report_warnings import turning
from tolstat.answers.revisions import (
    Changes,
    Revision,
    before_each,
    changes_since,
    revision_of,
)
from tolstat.answers.sampled_trials import drawn_trials
from tolstat.answers.sketches import sketch_of
from tolstat.document.blocks import Sketch
from tolstat.document.inline import Number, Row
from tolstat.errors import DamagedError, FormatError, RunFileError, TolstatError
from tolstat.regular_files import opened
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.limits.yields import WORST_FIRST, Yield
from tolstat.status import Status
from tolstat.store.files_beside import before_of, identity, writer_of
from tolstat.store.open_run import open as open_run
from tolstat.store.stored_run import Run
from tolstat.units.scale import PPM

GENERATOR, HEAD = b'name="generator" content="tolstat"', 10_000  # of a page, bytes
# of files that cannot be read; else no run
STATES: dict[type, str] = {DamagedError: "damaged", FormatError: "other format"}


@dataclass(frozen=True)
class Entry:
    """A run, or a file that is no readable run, as a row."""

    study: str
    title: str = ""  # empty where nothing can be read
    model: str = ""
    state: str = ""  # "complete", ..., "no run"; of a batch the state of the study
    trials: int = 0  # requested
    ran: int = 0
    failed: int | None = 0  # None for a rare run, whose trials are no sample
    verdicts: str = ""  # on its limits, not met first
    written: str = ""  # when, with its zone
    seconds: float = 0.0  # that it took
    bytes: int = 0
    run: Path | None = None
    report: Path | None = None
    problem: str = ""  # why it is damaged or no run, or what stopped it
    # the limit that decides: of the worst verdict, then of most trials out of limit
    limit: str = ""
    fraction_out_of_limit: Estimate = NONE  # of this limit
    changes: Changes | None = None  # since the run before of the same drawing
    sketch: Sketch | None = field(default=None, metadata={"json": False})  # of it
    revision: Revision | None = field(default=None, metadata={"json": False})
    # that the run file had before, if it is known
    before: Revision | None = field(default=None, metadata={"json": False})

    def but(self, **changes: Any) -> Entry:
        """Return the same row with some other fields."""
        return replace(self, **changes)


COLUMNS = (
    "study", "title", "model", "state", "trials", "ran", "failed", "verdicts",
    "written", "seconds", "bytes", "run", "report", "problem",
)  # fmt: skip  # of words and numbers


@dataclass(frozen=True, repr=False)
class RunIndex(Answer):
    """Runs, or the studies of a batch."""

    title: str
    folder: Path  # from where files are named
    entries: tuple[Entry, ...]
    noun: str = field(default="run", metadata={"json": False})  # what an entry is
    answers = "runs"
    index = "study"

    @property
    def _short(self) -> str:
        return f"{len(self.entries)} runs in {self.folder}"

    def rows(self) -> list[Row]:
        """Return a row for each with all fields; paths are relative to the folder."""
        return [
            {
                **{name: getattr(entry, name) for name in COLUMNS},
                "failed": "" if entry.failed is None else entry.failed,
                "seconds": Number(entry.seconds),
                "run": self.relative(entry.run),
                "report": self.relative(entry.report),
                "limit": entry.limit,
                "out of limit [ppm]": Number(entry.fraction_out_of_limit, PPM),
            }
            for entry in self.entries
        ]

    @property
    def dated(self) -> RunIndex:
        """The same with the changes of each run since the one before."""
        before = before_each(entry.revision for entry in self.entries)
        entries = (
            entry if entry.changes or number is None or not entry.revision
            else entry.but(changes=self._changes(self.entries[number], entry))
            for entry, number in zip(self.entries, before, strict=True)
        )  # fmt: skip
        return replace(self, entries=tuple(entries))

    def _changes(self, before: Entry, after: Entry) -> Changes | None:
        return _changes(self.relative(before.run), before, after)

    def relative(self, path: Path | None) -> str:
        """Return a path relative to the folder."""
        return Path(os.path.relpath(path, self.folder)).as_posix() if path else ""


def _changes(against: str, before: Entry, after: Entry) -> Changes | None:
    if not (before.revision and after.revision):
        return None
    return changes_since(against, before.revision, after.revision)


def stored_runs(folder: Path) -> RunIndex:
    """Return the runs of a folder and its subfolders.

    Raises
    ------
    RunFileError
        If there is no such folder.
    """
    entries = map(entry_at, _stored_in(folder))
    named = (entry.but(study=str(entry.run)) for entry in entries)
    return RunIndex("", folder, tuple(named))


def with_reports(index: RunIndex, folder: Path) -> RunIndex:
    """Return an index for a page in a folder, with links to reports that exist."""
    entries = (
        entry.but(report=_report(entry.run) if entry.run else None)
        for entry in index.entries
    )
    return replace(index, title="Runs", folder=folder, entries=tuple(entries))


def _report(run: Path) -> Path | None:
    """Return the report of a run, unless that is older than the run."""
    page = run.with_suffix(".html")
    with suppress(OSError), opened(page) as file:
        newer = page.stat().st_mtime >= run.stat().st_mtime
        if newer and GENERATOR in file.read(HEAD):
            return page
    return None


def entry_of(run: Run) -> Entry:
    """Return the row of a run."""
    yields = judged(run)
    verdicts = _by_verdict(run, yields)
    worst = min(yields, key=lambda name: yields[name].urgency, default="")
    words = (f"{word}: {', '.join(names)}" for word, names in verdicts.items())
    return Entry(
        run.path.stem, run.title, run.model,
        state="complete" if run.complete else "in part" if run.ended else "planned",
        trials=run.trials, ran=run.ended, failed=None if run.aim else run.failed,
        verdicts="; ".join(words), written=run.provenance["ended_at"],
        seconds=run.provenance["seconds"], bytes=run.path.stat().st_size,
        run=run.path,
        limit=worst,
        fraction_out_of_limit=yields[worst].fraction_out_of_limit if worst else NONE,
        sketch=_sketch(run, worst) if worst and not run.aim else None,
        revision=revision_of(run, yields),
    )  # fmt: skip


def _sketch(run: Run, name: str) -> Sketch | None:
    random = run.first(run.random_trials)
    values = random.column(name)[random.status == Status.DONE]
    return sketch_of(name, values, run.limits[name], run.scales[name])


def judged(run: Run) -> Mapping[str, Yield]:
    """Return the verdict on each limit, from the trials that ran; none of a grid."""
    if (trials := drawn_trials(run)) is None or not trials.sample.ran.any():
        return {}
    yields = {name: trials.yield_of(name) for name in run.limits}
    turned = turning(run, trials.trials_done)
    return yields | {name: yields[name].jumping for name in turned}


def _by_verdict(run: Run, yields: Mapping[str, Yield]) -> dict[str, list[str]]:
    """Return limited responses by verdict, the worst first.

    Of a grid or a table a verdict is how many trials are out of limit.
    """
    words = {name: verdict.words for name, verdict in yields.items()}
    ranks = {x.words: WORST_FIRST.index(x.verdict) for x in yields.values()}
    if run.sampled is None and run.ended:
        for name in run.limits:
            out = np.count_nonzero(run.beyond(name))
            words[name] = f"{out} of {run.ended} out of limit"
    last = len(WORST_FIRST)
    ordered = sorted(dict.fromkeys(words.values()), key=lambda x: ranks.get(x, last))
    return {word: [n for n in words if words[n] == word] for word in ordered}


def _stored_in(folder: Path) -> Iterable[Path]:
    """Yield the files of a folder that end in .h5, and those of the folders in it."""
    if folder.is_file():
        raise RunFileError(f"{folder} is a file; a folder is expected")
    if not folder.is_dir():
        raise RunFileError(f"{folder}: no such folder")
    for path, folders, files in os.walk(folder):
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        yield from (Path(path, name) for name in sorted(files) if name.endswith(".h5"))


def entry_at(path: Path) -> Entry:
    """Return the row of a file, also of one that is no run."""
    try:
        run = open_run(path, damaged=True)
        entry, problem = _with_kept(entry_of(run), run), run.damage.words
        if not run.complete and writer_of(path):
            entry = entry.but(state="running")
        return entry.but(state="damaged", problem=problem) if problem else entry
    except (TolstatError, OSError) as error:
        state, problem = STATES.get(type(error), "no run"), str(error)
    size = path.stat().st_size if path.is_file() else 0
    return Entry(path.stem, state=state, bytes=size, run=path, problem=problem)


def _with_kept(entry: Entry, run: Run) -> Entry:
    """Return the row of a run that replaces one, with the changes since that one.

    That one is kept until the new run is complete.
    """
    path = before_of(run.path)
    if run.replaces and identity(path) == run.replaces:
        with suppress(TolstatError):
            before = entry_of(open_run(path, damaged=True))
            return entry.but(changes=_changes(path.name, before, entry))
    return entry
