"""Stored runs on the screen: a row for each."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path

from rich.table import Table

from tolstat.answers.index.run_entries import Entry, entry_at, stored_in
from tolstat.cli.showing import WIDE, print_words, screen, words_table

FIRST = ("study", "state", "limits", "trials", "failed")  # of `row_of`
AGES = ((86400.0, "d"), (3600.0, "h"), (60.0, "min"), (0.0, "s"))  # from s on


def list_runs(folder: Path) -> bool:
    """Print what is stored in a folder and below; tell whether none is damaged."""
    entries = [entry_at(path) for path in stored_in(folder)]
    console = screen()
    if not entries:
        console.print(f"no run is stored in {folder}")
        return True
    more = ("model", "size") if console.width >= WIDE else ()
    table = runs_table(*FIRST, "age", *more)
    for each in entries:
        row = row_of(each._replace(study=str(each.path)))
        row += [age_of(each.written), each.model, f"{each.size / 1e6:.1f} MB"]
        table.add_row(*row[: len(table.columns)])
    print_words(table)
    if not more:
        console.print(f"with {WIDE} columns: model and size of each, too")
    for each in entries:
        if each.problem:
            said = each.problem.removeprefix(str(each.path)).lstrip(": ")
            console.print(f"{each.path}: {said}", soft_wrap=True)
    return not any(each.problem for each in entries)


def runs_table(*heads: str) -> Table:
    """Return a table of runs: of what `row_of` says, and what else stands in it."""
    words = ("study", "state", "limits", "model")
    return words_table("", *heads, numbers=[n for n in heads if n not in words])


def row_of(entry: Entry) -> list[str]:
    """Write an entry in words."""
    trials = f"{entry.ended} of {entry.trials}" if entry.trials else ""
    failed = str(entry.failed) if entry.ended and entry.failed is not None else ""
    if entry.ended == entry.trials and entry.trials:
        trials = str(entry.trials)
    return [entry.study, entry.state, entry.verdicts, trials, failed]


def age_of(written: str) -> str:
    """Say how long ago something was written, in its largest unit."""
    if not written:
        return ""
    seconds = (
        datetime.now().astimezone() - datetime.fromisoformat(written)
    ).total_seconds()
    size, unit = next(each for each in AGES if seconds >= each[0])
    return f"{seconds / max(size, 1.0):.0f} {unit}"
