"""Runs and models printed on the screen."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich import box
from rich.cells import cell_len
from rich.console import Console
from rich.table import Table
from rich.text import Text

from tolstat.answers.report.ask import summary
from tolstat.answers.report.summary_table import Cell
from tolstat.answers.sweep.curves import comparisons
from tolstat.literal import visible
from tolstat.render.screen import show
from tolstat.store.open_run import open as open_run
from tolstat.store.stored_run import Run

# where the output is no terminal
PIPED_WIDTH = 120
# from this width on an interval stands in one line
WIDE = 120
UNBOUNDED = 100_000
PADDING = 0, 1, 0, 0  # of a cell
# columns that hold words
WORDS = ("", "contributor", "response", "unit", "limit", "status", "beyond", "note")


class Screen(Console):
    """A terminal on which every text is what it is: no markup, no ESC, no emoji."""

    def __init__(self, **options: Any) -> None:
        super().__init__(highlight=False, markup=False, emoji=False, **options)

    def render_str(self, text: str, **options: Any) -> Text:
        """Make a text, of which everything is seen."""
        return super().render_str(visible(text), **options)


def screen(least: int = 0) -> Screen:
    """Return the standard output; one with fewer columns than asked wraps lines."""
    console = Screen()
    width = console.width if console.is_terminal else PIPED_WIDTH
    return Screen(width=max(width, least))


def print_summary(run: Run) -> bool:
    """Print the summary of a run; false if a limit is not met."""
    found = summary(run)
    show(found.document())
    return not found.not_met


def print_table(
    title: str, heads: list[str], rows: list[list[Cell]], *, wide: bool
) -> None:
    """Print a table, words to the left and numbers to the right.

    Nothing is ever cut: a number without its last digits is another number. Columns
    that do not fit beside each other follow below, under the names of the rows. Where
    it is `wide` an interval stands in one line.
    """
    lines = [[_in_lines(cell, wide) for cell in row] for row in rows]
    named = 2 if heads[1:2] == ["unit"] else 1  # columns that say what a row is
    names, left = list(range(named)), list(range(named, len(heads)))
    room, shown = screen().width, title
    while True:
        count = max(len(left), 1)
        table = _of_columns(heads, lines, names + left[:count])
        while count > 1 and _width(table) > room:
            count -= 1
            table = _of_columns(heads, lines, names + left[:count])
        table.title = shown
        _print_titled(table, screen(least=_width(table)))
        left, shown = left[count:], f"{title}, continued"
        if not left:
            return


def _of_columns(heads: list[str], lines: list[list[str]], chosen: list[int]) -> Table:
    """Make a table of some columns."""
    table = Table(box=box.SIMPLE_HEAD, padding=PADDING)
    for i in chosen:
        words = heads[i] in WORDS
        table.add_column(heads[i], justify="left" if words else "right", no_wrap=True)
    for line in lines:
        table.add_row(*(line[i] for i in chosen))
    return table


def _width(table: Table) -> int:
    """Return how wide a table is where nothing of it is cut."""
    return Screen(width=UNBOUNDED).measure(table).maximum


def words_table(title: str, *heads: str, numbers: Sequence[str] = ()) -> Table:
    """Return a table whose sentences wrap, and whose names and numbers do not.

    The first column holds names, those of `numbers` hold numbers, to the right.
    """
    table = Table(title=title or None, box=box.SIMPLE_HEAD, padding=PADDING)
    for i, head in enumerate(heads):
        if head in numbers:
            table.add_column(head, justify="right", no_wrap=True)
        else:
            table.add_column(head, no_wrap=i == 0, overflow="fold")
    return table


def print_words(table: Table) -> None:
    """Print a table of `words_table`: no word or number of it is cut."""
    widths, longest = dict[int, int](), dict[int, int]()  # of columns that wrap
    for i, column in enumerate(table.columns):
        if not column.no_wrap:
            cells = [visible(str(cell)) for cell in (column.header, *column.cells)]
            longest[i] = max(map(cell_len, cells))
            widths[i] = max(map(cell_len, " ".join(cells).split()), default=1)
            column.width = widths[i]
    room = screen(least=_width(table))
    # Rich would share the room without regard to the longest words
    for _ in range(room.width - _width(table)):
        i = max(longest, key=lambda i: longest[i] / widths[i])
        widths[i] += widths[i] < longest[i]
        table.columns[i].width = widths[i]
    _print_titled(table, room)


def _print_titled(table: Table, room: Screen) -> None:
    """Print a table under its title, which Rich would wrap to a narrow table."""
    if table.title:
        room.print(table.title, style="table.title")
    table.title = None
    room.print(table)


def _in_lines(cell: Cell, wide: bool) -> str:
    """Write a number over its interval, in two lines or in three."""
    if isinstance(cell, str):
        return cell
    value, lower, upper = cell
    return f"{value}\n{lower}..{upper}" if wide else f"{value}\n{lower}\n{upper}"


def show_run(path: Path) -> None:
    """Print the summary of a stored run, and the machines of a table."""
    run = open_run(path)
    print_summary(run)
    if run.sampling == "table":
        _print_rows(run)
    print_comparisons(run)


def _print_rows(run: Run) -> None:
    from tolstat.answers.sweep.table_rows import table_rows

    found = table_rows(run)
    print_table(found.title, found.heads, [[*row] for row in found.rows], wide=True)
    for note in found.notes:
        screen().print(note)


def print_comparisons(run: Run) -> None:
    """Print what a grid run says beside its reference."""
    for title, heads, rows, note in comparisons(run):
        print_table(title, heads, [[*row] for row in rows], wide=True)
        if note:
            screen().print(note)


def plot_runs(paths: list[Path], picture: Path, responses: tuple[str, ...]) -> None:
    """Draw grid runs as curves, and print what stands beside a reference."""
    from tolstat.answers.sweep.curve_picture import draw_sweeps
    from tolstat.render.picture import check_ending, write

    check_ending(picture)
    runs = [open_run(path) for path in paths]
    write(draw_sweeps(runs, responses), picture)
    for run in runs:
        print_comparisons(run)
    screen().print(f"drawn in {picture}")
