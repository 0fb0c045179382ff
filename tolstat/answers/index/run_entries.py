"""Stored runs beside each other: a row for each, as a table, as CSV, as a page."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple
from urllib.parse import quote

import numpy as np

from tolstat.answers.rare.rare_answer import rare_summary
from tolstat.answers.sampled_trials import drawn_trials
from tolstat.errors import DamagedError, RunFileError, TolstatError
from tolstat.render.page import environment, style
from tolstat.render.plain import csv_text
from tolstat.statistics.limits.yields import NOT_MET, UNDECIDED, yield_of
from tolstat.store.open_run import open as open_run
from tolstat.store.stored_run import Run

COMPLETE, IN_PART, PLANNED, DAMAGED, NO_RUN = (
    "complete", "in part", "planned", "damaged", "no run",
)  # fmt: skip
HEADS = (
    "study", "title", "model", "state", "trials", "ended", "failed", "verdicts",
    "written", "seconds", "bytes", "run", "report", "problem",
)  # fmt: skip


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
        Asked for, and over.
    failed : int or None
        Of these; None where machines were sought, and failed ones with them.
    verdicts : str
        On its limits, those that are not met first.
    written : str
        When the file was written last, with its zone.
    seconds : float
        How long it took.
    size : int
        Of the file, bytes.
    path, report : Path or None
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
    size: int = 0
    path: Path | None = None
    report: Path | None = None
    problem: str = ""
    not_met: bool = False


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
        Limited responses by verdict, the worst first; of machines that were chosen and
        not drawn by how many of them are beyond.
    """
    if run.aim:
        return {rare_summary(run).verdict: [run.aim]} if run.ended else {}
    found: dict[str, list[str]] = {}
    drawn = drawn_trials(run)
    for name, limit in run.limits.items() if run.ended else ():
        if drawn is None:
            word = f"{np.count_nonzero(run.beyond(name))} of {run.ended} beyond"
        elif drawn.sample.ran.any():
            values = drawn.values(name)
            judged = yield_of(values, drawn.sample, limit.permitted, limit.demanded)
            word = judged.verdict
        else:
            continue
        found.setdefault(word, []).append(name)
    rank = {NOT_MET: 0, UNDECIDED: 1}
    return dict(sorted(found.items(), key=lambda each: rank.get(each[0], 2)))


def stored_in(folder: Path) -> list[Path]:
    """Return the files of a folder that end in .h5, and those of the folders in it.

    Raises
    ------
    RunFileError
        If there is no such folder.
    """
    if folder.is_file():
        raise RunFileError(f"{folder} is no folder; `tolstat show` tells of one run")
    if not folder.is_dir():
        raise RunFileError(f"{folder}: there is no such folder")
    found = []
    for here, folders, files in os.walk(folder):
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        found += [Path(here, name) for name in sorted(files) if name.endswith(".h5")]
    return found


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
    return Entry(path.stem, state=state, size=size, path=path, problem=problem)


def index_csv(entries: Sequence[Entry], folder: Path) -> str:
    """Write entries as CSV; files are named as seen from a folder."""
    rows = [
        [*each[:11], *(_seen(path, folder) for path in each[11:13]), each.problem]
        for each in entries
    ]
    return csv_text(HEADS, rows)


def index_page(entries: Sequence[Entry], folder: Path, title: str) -> str:
    """Make a page of entries, with links to reports, as seen from a folder."""
    template = environment().get_template("index.html")
    page: str = template.render(
        title=title,
        style=style(),
        rows=[(each, quote(_seen(each.report, folder))) for each in entries],
    )
    return page


def _seen(path: Path | None, folder: Path) -> str:
    """Name a file as seen from a folder."""
    return Path(os.path.relpath(path, folder)).as_posix() if path else ""
