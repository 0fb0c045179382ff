"""Stored runs on the screen: a row for each."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path

from rich.table import Table

from tolstat.cli.showing import print_words, screen, words_table
from tolstat.reporting.listing import Entry, entry_at, stored_in

AGES = ((86400.0, "d"), (3600.0, "h"), (60.0, "min"), (0.0, "s"))  # from s on


def list_runs(folder: Path) -> bool:
    """Print what is stored in a folder and below; tell whether none is damaged."""
    entries = [entry_at(path) for path in stored_in(folder)]
    console = screen()
    if not entries:
        console.print(f"no run is stored in {folder}")
        return True
    table = runs_table("age", "size")
    for each in entries:
        named = each._replace(study=str(each.path))
        table.add_row(*row_of(named), age_of(each.written), f"{each.size / 1e6:.1f} MB")
    print_words(table)
    for each in entries:
        if each.problem:
            console.print(f"{each.path}: {each.problem}", soft_wrap=True)
    return not any(each.problem for each in entries)


def runs_table(*more: str) -> Table:
    """Return a table for rows of `row_of`, and what else is to stand in them."""
    heads = ("study", "model", "state", "trials", "failed", "limits", *more)
    return words_table("", *heads, numbers=("trials", "failed", *more))


def row_of(entry: Entry) -> list[str]:
    """Write an entry in words."""
    trials = f"{entry.ended} of {entry.trials}" if entry.trials else ""
    failed = str(entry.failed) if entry.ended else ""
    if entry.ended == entry.trials and entry.trials:
        trials = str(entry.trials)
    return [entry.study, entry.model, entry.state, trials, failed, entry.verdicts]


def age_of(written: str) -> str:
    """Say how long ago something was written, in its largest unit."""
    if not written:
        return ""
    seconds = (
        datetime.now().astimezone() - datetime.fromisoformat(written)
    ).total_seconds()
    size, unit = next(each for each in AGES if seconds >= each[0])
    return f"{seconds / max(size, 1.0):.0f} {unit}"
