"""Runs and models printed on the screen."""

from __future__ import annotations

from pathlib import Path

from rich import box
from rich.console import Console
from rich.table import Table

from tolstat.reporting.summary_table import Cell, summary_table
from tolstat.reporting.sweep import comparisons
from tolstat.store.opening import open as open_run
from tolstat.store.run import Run

# where the output is no terminal
PIPED_WIDTH = 120
# from this width on an interval stands in one line
WIDE = 120


def screen() -> Console:
    """Return the standard output."""
    # no markup: titles, names and paths are anybody's
    console = Console(highlight=False, markup=False)
    if console.is_terminal:
        return console
    return Console(width=PIPED_WIDTH, highlight=False, markup=False)


def print_summary(run: Run) -> None:
    """Print the summary tables of a run.

    Parameters
    ----------
    run : Run
        Complete or not.
    """
    console = screen()
    summary = summary_table(run)
    parts = [(summary.title, summary.heads, summary.rows)]
    if summary.limit_rows:
        parts.append(("limits", summary.limit_heads, summary.limit_rows))
    for title, heads, rows in parts:
        print_table(title, heads, rows, wide=console.width >= WIDE)
    for note in summary.notes:
        console.print(note)


def print_table(
    title: str, heads: list[str], rows: list[list[Cell]], *, wide: bool
) -> None:
    """Print a table, words to the left and numbers to the right.

    Parameters
    ----------
    title : str
        Above it.
    heads : list of str
        Of the columns.
    rows : list of list of Cell
        Numbers stand over their intervals.
    wide : bool
        Whether an interval stands in one line.
    """
    table = Table(title=title, box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for head in heads:
        words = head in ("response", "unit", "limit")
        table.add_column(head, justify="left" if words else "right", no_wrap=True)
    for row in rows:
        table.add_row(*(_in_lines(cell, wide) for cell in row))
    screen().print(table)


def _in_lines(cell: Cell, wide: bool) -> str:
    """Write a number over its interval, in two lines or in three."""
    if isinstance(cell, str):
        return cell
    value, lower, upper = cell
    return f"{value}\n{lower}..{upper}" if wide else f"{value}\n{lower}\n{upper}"


def show_run(path: Path) -> None:
    """Print the summary of a stored run."""
    run = open_run(path)
    print_summary(run)
    print_comparisons(run)


def print_comparisons(run: Run) -> None:
    """Print what a grid run says beside its reference."""
    console = screen()
    for title, heads, rows, note in comparisons(run):
        table = Table(title=title, box=box.SIMPLE_HEAD)
        for head in heads:
            table.add_column(head, justify="right")
        for row in rows:
            table.add_row(*row)
        console.print(table)
        if note:
            console.print(note)


def plot_runs(paths: list[Path], picture: Path, responses: tuple[str, ...]) -> None:
    """Draw grid runs as curves, and print what stands beside a reference."""
    from tolstat.reporting.picture import check_ending, write
    from tolstat.reporting.sweep_picture import draw_sweeps

    check_ending(picture)
    runs = [open_run(path) for path in paths]
    write(draw_sweeps(runs, responses), picture)
    for run in runs:
        print_comparisons(run)
    screen().print(f"drawn in {picture}")
