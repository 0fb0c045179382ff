"""Stored runs beside each other: a row for each."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tolstat.answers.answer import Answer
from tolstat.answers.rare.rare_answer import rare_summary
from tolstat.answers.sampled_trials import drawn_trials
from tolstat.document.blocks import (
    Block,
    Column,
    Document,
    Given,
    Table,
    Verbatim,
    paragraph,
    table,
)
from tolstat.document.inline import Link, Number, Parts, text
from tolstat.errors import DamagedError, RunFileError, TolstatError
from tolstat.render.tables import Row
from tolstat.statistics.limits.yields import NOT_MET, UNDECIDED, yield_of
from tolstat.store.open_run import open as open_run
from tolstat.store.stored_run import Run
from tolstat.units.scale import AS_IS

COMPLETE, IN_PART, PLANNED, DAMAGED, NO_RUN = (
    "complete", "in part", "planned", "damaged", "no run",
)  # fmt: skip
SIZE = AS_IS._replace(most=2)


class Entry(NamedTuple):
    """A run, or what stands where one should be, in a row.

    Attributes
    ----------
    study : str
        Name of its study.
    title, model : str
        Of the study; empty where nothing can be read.
    state : str
        "complete", "in part", "planned", "damaged", "no run"; of a queue what became
        of the study.
    trials, ended : int
        Requested, and over.
    failed : int or None
        Of these; None of a rare run, whose trials are no sample.
    verdicts : str
        On its limits, those that are not met first.
    written : str
        When the file was written last, with its zone.
    seconds : float
        How long it took.
    bytes : int
        Size of the file.
    run, report : Path or None
        The run, and its page.
    problem : str
        Why it is damaged or no run, or what stopped it.
    not_met : bool
        Whether a limit is found to be not met.
    """

    study: str
    title: str = ""
    model: str = ""
    state: str = ""
    trials: int = 0
    ended: int = 0
    failed: int | None = 0
    verdicts: str = ""
    written: str = ""
    seconds: float = 0.0
    bytes: int = 0
    run: Path | None = None
    report: Path | None = None
    problem: str = ""
    not_met: bool = False

    @property
    def progress(self) -> Parts:
        """How many of its trials are over."""
        if not self.trials:
            return ()
        if self.ended == self.trials:
            return (Number(self.trials),)
        return Number(self.ended), " of ", Number(self.trials)


@dataclass(frozen=True, repr=False)
class RunIndex(Answer):
    """Runs, or the studies of a batch.

    Attributes
    ----------
    title : str
        What they are.
    folder : Path
        From where files are named.
    entries : tuple of Entry
        In order.
    """

    title: str
    folder: Path
    entries: tuple[Entry, ...]
    answers = "runs"
    index = "study"

    @property
    def short(self) -> str:
        """How many runs there are."""
        return f"{len(self.entries)} runs in {self.folder}"

    def document(self) -> Document:
        """Return a table of them, and what is wrong with some."""
        every = (
            *self._columns(), "model", "written", "size",
            Column("title", words=True, page_only=True), Column("s", page_only=True),
        )  # fmt: skip
        rows: list[Sequence[Given]] = [
            (*self._cells(each), each.model, _minute(each.written),
             text(Number(each.bytes / 1e6, SIZE), " MB"), each.title,
             Number(each.seconds))
            for each in self.entries
        ]  # fmt: skip
        problems = [_problem(each) for each in self.entries if each.problem]
        shown: tuple[Block, ...] = (table(every, rows), *problems)
        return Document(self.title, shown if rows else (paragraph(self._nothing),))

    @property
    def _nothing(self) -> str:
        return f"no run is stored in {self.folder}"

    def progress(self) -> Table:
        """Return what changes while they run."""
        return table(self._columns(), map(self._cells, self.entries))

    def _columns(self) -> tuple[Column | str, ...]:
        return "study", "state", Column("limits", words=True), "trials", "failed"

    def _cells(self, each: Entry) -> tuple[Parts, ...]:
        """Write what a run is, and how far."""
        page = self._seen(each.report)
        failed = each.failed if each.ended else None
        return (
            (Link(each.study, page) if page else each.study,),
            (each.state,),
            (each.verdicts,),
            each.progress,
            () if failed is None else (Number(failed),),
        )

    def rows(self) -> list[Row]:
        """Return all that is known of each; files are named as seen from the folder."""
        return [
            {
                "study": each.study, "title": each.title, "model": each.model,
                "state": each.state, "trials": each.trials, "ended": each.ended,
                "failed": "" if each.failed is None else each.failed,
                "verdicts": each.verdicts, "written": each.written,
                "seconds": Number(each.seconds), "bytes": each.bytes,
                "run": self._seen(each.run), "report": self._seen(each.report),
                "problem": each.problem,
            }
            for each in self.entries
        ]  # fmt: skip

    def _seen(self, path: Path | None) -> str:
        """Name a file as seen from the folder."""
        return Path(os.path.relpath(path, self.folder)).as_posix() if path else ""


def _minute(written: str) -> str:
    return f"{datetime.fromisoformat(written):%Y-%m-%d %H:%M}" if written else ""


def _problem(each: Entry) -> Verbatim:
    said = each.problem.removeprefix(str(each.run)).lstrip(": ")
    return Verbatim(f"{each.run or each.study}: {said}")


def stored_runs(folder: Path) -> RunIndex:
    """Return the runs of a folder, and of those in it.

    Raises
    ------
    RunFileError
        If there is no such folder.
    """
    entries = map(entry_at, _stored_in(folder))
    named = (each._replace(study=str(each.run)) for each in entries)
    return RunIndex("", folder, tuple(named))


def entry_of(run: Run) -> Entry:
    """Say of a run what fits into a row."""
    state = IN_PART if run.ended else PLANNED
    verdicts = verdicts_of(run)
    return Entry(
        run.path.stem,
        run.title,
        run.model,
        COMPLETE if run.complete else state,
        run.trials,
        run.ended,
        None if run.aim else run.failed,
        "; ".join(f"{word}: {', '.join(some)}" for word, some in verdicts.items()),
        run.provenance["ended_at"],
        run.provenance["seconds"],
        run.path.stat().st_size,
        run.path,
        not_met=NOT_MET in verdicts,
    )


def verdicts_of(run: Run) -> dict[str, list[str]]:
    """Judge the limits of a run.

    Returns
    -------
    dict of str to list of str
        Limited responses by verdict, the worst first; of a grid or a table by how many
        trials are out of limit.
    """
    if run.aim:
        return {rare_summary(run).verdict: [run.aim]} if run.ended else {}
    found: dict[str, list[str]] = {}
    drawn = drawn_trials(run)
    for name, limit in run.limits.items() if run.ended else ():
        if drawn is None:
            out = np.count_nonzero(run.beyond(name))
            word = f"{out} of {run.ended} out of limit"
        elif drawn.sample.ran.any():
            values = drawn.values(name)
            judged = yield_of(values, drawn.sample, limit.permitted, limit.demanded)
            word = judged.verdict
        else:
            continue
        found.setdefault(word, []).append(name)
    rank = {NOT_MET: 0, UNDECIDED: 1}
    return dict(sorted(found.items(), key=lambda each: rank.get(each[0], 2)))


def _stored_in(folder: Path) -> Iterable[Path]:
    """Yield the files of a folder that end in .h5, and those of the folders in it."""
    if folder.is_file():
        raise RunFileError(f"{folder} is a file; a folder is expected")
    if not folder.is_dir():
        raise RunFileError(f"{folder}: no such folder")
    for here, folders, files in os.walk(folder):
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        yield from (Path(here, name) for name in sorted(files) if name.endswith(".h5"))


def entry_at(path: Path) -> Entry:
    """Say of a file what fits into a row, whatever it is."""
    try:
        run = open_run(path, damaged=True)
        found = entry_of(run)
        if run.damage:
            found = found._replace(state=DAMAGED, problem=run.damage.words)
        return found
    except DamagedError as error:
        state, problem = DAMAGED, str(error)
    except (TolstatError, OSError) as error:
        state, problem = NO_RUN, str(error)
    size = path.stat().st_size if path.is_file() else 0
    return Entry(path.stem, state=state, bytes=size, run=path, problem=problem)
