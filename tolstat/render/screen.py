"""A document on the screen: nothing is cut, and every text is what it is."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import Any

from rich import box
from rich.cells import cell_len
from rich.console import Console
from rich.table import Table as RichTable
from rich.text import Text

from tolstat.document.blocks import (
    Beside,
    Block,
    Bullets,
    Cell,
    Document,
    Facts,
    Paragraph,
    Section,
    Table,
    Verbatim,
)
from tolstat.document.digits import in_cell, in_line, plain
from tolstat.document.inline import Inline, Number, Parts, Typed
from tolstat.literal import visible

PIPED_WIDTH = 120  # where the output is no terminal
UNBOUNDED = 100_000
PADDING = 0, 1, 0, 0  # of a cell
UNBROKEN = "\ue000"  # stands for a space where no line may end
REASON = 24  # letters in a line of words below a number


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


def show(document: Document) -> None:
    """Print a document on the standard output: its tables and sentences."""
    _show(Section(document.title, document.blocks))


def _show(block: Block) -> None:
    match block:
        case Section(page_only=True) | Table(page_only=True):
            return
        case Section() | Beside():
            if title := getattr(block, "title", ""):
                _print_title(title)
            for each in block.blocks:
                _show(each)
        case Table():
            show_table(block)
        case Paragraph():
            _print(block.parts)
        case Bullets():
            for i, item in enumerate(block.items, 1):
                _print(item, f"{i}. " if block.numbered else "- ")
        case Facts():
            for name, parts in block.rows:
                _print((f"{name}: ", *parts))
        case Verbatim():
            screen().print(block.text, soft_wrap=True)
        case _:
            pass  # figures are for pages


def as_text(parts: Parts) -> str:
    """Write the parts of a sentence as plain text."""
    return "".join(
        plain(in_line(part))
        if isinstance(part, Number)
        else part
        if isinstance(part, str)
        else part.text
        for part in parts
    )


def _print(parts: Parts, before: str = "") -> None:
    """Print a sentence; numbers keep their units, and a command has its own line."""
    left = list(parts)
    while left:
        typed = [i for i, part in enumerate(left) if isinstance(part, Typed)]
        end = typed[0] if typed else len(left)
        words = before + "".join(map(_unbroken, left[:end]))
        if words.strip(" ."):
            _print_wrapped(words.rstrip())
        if typed:
            screen().print(f"   {as_text((left[end],))}", soft_wrap=True)
        before, left = "", left[end + 1 :]


def _unbroken(part: Inline) -> str:
    return part if isinstance(part, str) else as_text((part,)).replace(" ", UNBROKEN)


def _print_wrapped(words: str) -> None:
    """Print words in lines that end at spaces alone."""
    console, lines = screen(), list[str]()
    for line in visible(words).splitlines():
        lines += textwrap.wrap(
            line, console.width, break_long_words=False, break_on_hyphens=False
        )
    console.print("\n".join(lines).replace(UNBROKEN, " "), soft_wrap=True)


def _print_title(title: str, least: int = 0) -> None:
    screen(least).print(title, style="table.title")


def as_rich(given: Table) -> RichTable:
    """Return a table for a live display; what does not fit is folded."""
    every = [i for i, column in enumerate(given.columns) if not column.page_only]
    return _folded(given, every, 1)


def show_table(given: Table) -> None:
    """Print a table: words to the left, numbers to the right.

    Nothing is ever cut: a number without its last digits is another number. Columns
    that do not fit beside each other follow below, under the names of the rows.
    """
    columns = [i for i, each in enumerate(given.columns) if not each.page_only]
    keys, left = columns[: given.keys], columns[given.keys :]
    title = given.title
    while True:
        count, room = max(len(left), 1), screen().width
        made = _folded(given, keys + left, REASON)
        while count > 1 and _width(made) > room:
            count -= 1
            made = _folded(given, keys + left[:count], REASON)
        least = _width(made)
        if least > room:
            made = _folded(given, keys + left[:count], 1)
            least = _width(made)
        if title:
            _print_title(title, least)
        screen(least).print(made)
        left = left[count:]
        if not left:
            break
        title = f"{given.title}, continued" if given.title else ""
    if given.caption:
        _print(given.caption)


def _made(given: Table, chosen: Sequence[int]) -> RichTable:
    """Make a table of some columns."""
    made = RichTable(box=box.SIMPLE_HEAD, padding=PADDING)
    for i in chosen:
        column = given.columns[i]
        made.add_column(
            column.head,
            justify="left" if given.sides[i] else "right",
            no_wrap=not column.words,
            overflow="fold",
        )
    for row in given.rows:
        # what explains the name of a row is for pages
        shown = [Cell(row[i].main) if i < given.keys else row[i] for i in chosen]
        wraps = (given.columns[i].words for i in chosen)
        made.add_row(*map(_in_lines, shown, wraps))
    return made


def _in_lines(cell: Cell, wraps: bool) -> str:
    """Write a number over its interval, or over the reason why it has none."""
    lines = []
    if len(cell.main) == 1 and isinstance(cell.main[0], Number):
        main, below = map(plain, in_cell(cell.main[0]))
        lines = [main] if main else []
        if below:
            lines += textwrap.wrap(below, REASON)
    elif cell.main:
        lines = [as_text(cell.main)]
    if cell.below:
        below = as_text(cell.below)
        lines += [below] if wraps else textwrap.wrap(below, REASON)
    return "\n".join(lines)


def _width(made: RichTable) -> int:
    """Return how wide a table is where nothing of it is cut."""
    return Screen(width=UNBOUNDED).measure(made).maximum


def _folded(given: Table, chosen: Sequence[int], least: int) -> RichTable:
    """Make a table of some columns whose words wrap, to `least` letters in a line.

    They share the room so that no word of them is cut; Rich would not regard that.
    """
    made = _made(given, chosen)
    widths, longest = dict[int, int](), dict[int, int]()
    for i, column in enumerate(made.columns):
        if not column.no_wrap:
            cells = [visible(str(cell)) for cell in (column.header, *column.cells)]
            longest[i] = max(map(cell_len, "\n".join(cells).splitlines()), default=1)
            word = max(map(cell_len, " ".join(cells).split()), default=1)
            widths[i] = max(word, min(longest[i], least))
            column.width = widths[i]
    for _ in range(screen().width - _width(made) if longest else 0):
        i = max(longest, key=lambda i: longest[i] / widths[i])
        widths[i] += widths[i] < longest[i]
        made.columns[i].width = widths[i]
    return made
