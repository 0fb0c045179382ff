"""A document on the screen: nothing is cut, texts are shown literally."""

import os
import re
import shlex
import textwrap
from collections.abc import Iterable, Sequence
from typing import Any

from rich import box
from rich.cells import cell_len
from rich.console import Console
from rich.segment import Segment
from rich.table import Table as RichTable
from rich.text import Text

from tolstat.document.blocks import (
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
from tolstat.document.inline import (
    Inline,
    Number,
    Parts,
    Typed,
    in_cell,
    in_line,
    plain,
)
from tolstat.literal import visible

PIPED_WIDTH = 120  # if the output is no terminal, and COLUMNS is not set
UNBOUNDED, NARROWEST = 100_000, 20
PADDING = 0, 1, 0, 0  # of a cell
AT_SPACES: Any = {"break_long_words": False, "break_on_hyphens": False}
UNBROKEN = "\ue000"  # stands for a space where no line may end
COMMAND = re.compile("`[^`]*`")
LETTERS = 24, 14, 10  # in a line of a head or below a number: the most that fit


class Screen(Console):
    """A terminal that shows texts literally: no markup, no ESC, no emoji."""

    def __init__(self, **options: Any) -> None:
        super().__init__(highlight=False, markup=False, emoji=False, **options)
        wide = self.is_terminal or os.environ.get("COLUMNS", "").strip("0").isdigit()
        if not wide and "width" not in options:  # messages in a log: one line each
            self.width = UNBOUNDED if self.stderr else PIPED_WIDTH
        self.width = min(max(self.width, NARROWEST), UNBOUNDED)

    def render_str(self, text: str, **options: Any) -> Text:
        """Return a text in which every character is visible."""
        return super().render_str(visible(text), **options)

    def render(self, *content: Any, **options: Any) -> Iterable[Segment]:
        """Yield texts in lines, with the spaces at which no line may end."""
        for segment in super().render(*content, **options):
            yield segment._replace(text=segment.text.replace(UNBROKEN, " "))

    def say(self, words: str) -> None:
        """Print words in lines that end at spaces, and at none in a `command`."""
        words = COMMAND.sub(lambda command: command[0].replace(" ", UNBROKEN), words)
        lines = list[str]()
        for line in visible(words).splitlines():
            indent = "    " if line.startswith(" ") else ""
            lines += textwrap.wrap(
                line, self.width, subsequent_indent=indent, **AT_SPACES
            )
        self.print("\n".join(lines), soft_wrap=True)

    def type(self, command: str) -> None:
        """Print a command to copy; a long one continues after a backslash."""
        words = (shlex.quote(word) for word in shlex.split(command))
        line = " ".join(word.replace(" ", UNBROKEN) for word in words)
        lines = [f"   {line}"]
        if cell_len(lines[0]) > self.width:
            lines = textwrap.wrap(
                line, self.width - 2, initial_indent=" " * 3,
                subsequent_indent=" " * 5, **AT_SPACES,
            )  # fmt: skip
        self.print(" \\\n".join(lines), soft_wrap=True)

    def on_broken_pipe(self) -> None:
        """Print no more: the reader, such as head, has ended; the work goes on."""
        os.dup2(os.open(os.devnull, os.O_WRONLY), self.file.fileno())


def show(document: Document) -> None:
    """Print a document on the standard output: its tables and sentences."""
    _show(Section(document.title, document.blocks))


def _show(block: Block) -> None:
    match block:
        case Section(page_only=True):
            return
        case Section():
            if block.title:
                _print_title(block.title)
            for part in block.blocks:
                _show(part)
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
            Screen().say(block.text)
        case _:
            pass  # figures are for pages


def as_text(parts: Parts) -> str:
    """Return the parts of a sentence as plain text."""
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
    rest, console = list(parts), Screen()
    while rest:
        typed = [i for i, part in enumerate(rest) if isinstance(part, Typed)]
        end = typed[0] if typed else len(rest)
        words = "".join(map(_unbroken, rest[:end])).strip()
        if words.strip(" ."):
            console.say((before + words).rstrip())
        if typed:
            console.type(as_text((rest[end],)))
        before, rest = "", rest[end + 1 :]


def _unbroken(part: Inline) -> str:
    return part if isinstance(part, str) else as_text((part,)).replace(" ", UNBROKEN)


def _print_title(title: str) -> None:
    Screen().print(title, style="table.title")


def as_rich(table: Table, width: int) -> RichTable:
    """Return a table for a live display of a width."""
    fits, _ = _fitting(table, width)
    return fits or _folded(table, LETTERS[-1], width)


def show_table(table: Table) -> None:
    """Print a table: words to the left, numbers to the right.

    Nothing is cut: a number without its last digits is wrong. If the columns do not fit
    beside each other, the spare ones are left out, and named. If the others do not fit
    either, each row is a list, with a line for each column.
    """
    if table.title:
        _print_title(table.title)
    fits, omitted = _fitting(table, Screen().width)
    if fits:
        Screen().print(fits)
    else:
        for row in table.rows:
            _print_row(table, row)
    if omitted:
        _print((f"on a wider screen also: {'; '.join(omitted)}",))
    if table.caption:
        _print(table.caption)


def _fitting(table: Table, width: int) -> tuple[RichTable | None, tuple[str, ...]]:
    """Return a table that fits a width, or None, and the columns that it leaves out."""
    for count in range(len(table.spare) + 1):
        omitted = table.spare[:count]
        for letters in LETTERS if count == len(table.spare) else LETTERS[:-1]:
            fitted = _folded(table, letters, width, omitted)
            if _width(fitted) <= width:
                return fitted, omitted
    return None, ()


def _print_row(table: Table, row: Sequence[Cell]) -> None:
    """Print the names of a row, and below them its cells by their heads."""
    names = [as_text(cell.main) for cell in row[: table.keys]]
    _print((", ".join(filter(None, names)),))
    for column, cell in [*zip(table.columns, row, strict=True)][table.keys :]:
        main, below = _written(cell)
        if below:
            words = "; ".join(below).replace(" to ", f"{UNBROKEN}to{UNBROKEN}")
            bracketed = words if words.startswith("(") else f"({words})"
            main = f"{main} {bracketed}" if main else words
        if main and not column.page_only:
            head = ", ".join(column.head.splitlines())
            _print((f"{head}: {main}" if head else main,), "  ")


def _written(cell: Cell) -> tuple[str, list[str]]:
    """Return a number, and its interval or the reason why it has none; or words."""
    main, interval = "".join(map(_unbroken, cell.main)), ""
    if len(cell.main) == 1 and isinstance(cell.main[0], Number):
        main, interval = map(plain, in_cell(cell.main[0]))
    below = "".join(map(_unbroken, cell.below))
    return main, [text for text in (interval, below) if text]


def _rich_table(table: Table, letters: int, omitted: Sequence[str]) -> RichTable:
    """Return a table; heads, and lines below a number, have at most these letters."""
    rich = RichTable(box=box.SIMPLE_HEAD, padding=PADDING)
    columns = enumerate(table.columns)
    numbers = [i for i, x in columns if not x.page_only and x.head not in omitted]
    for i in numbers:
        column = table.columns[i]
        head = column.head if column.words else _wrapped(column.head, letters)
        rich.add_column(
            head,
            justify="left" if table.sides[i] else "right",
            no_wrap=not column.words,
            overflow="fold",
        )
    for row in table.rows:
        rich.add_row(*(_in_lines(table, i, row[i], letters) for i in numbers))
    return rich


def _in_lines(table: Table, column: int, cell: Cell, letters: int) -> str:
    """Return the lines of a cell; explanations of row names are for pages."""
    main, below = _written(cell)
    if column < table.keys:
        below = []
    elif not table.columns[column].words:
        below = [
            line for text in below
            for line in textwrap.wrap(text, letters, **AT_SPACES)
        ]  # fmt: skip
    return "\n".join(filter(None, (main, *below)))


def _wrapped(words: str, letters: int) -> str:
    lines = (textwrap.wrap(line, letters, **AT_SPACES) for line in words.splitlines())
    return "\n".join(part for line in lines for part in line)


def _width(table: RichTable) -> int:
    """Return the width of a table of which nothing is cut."""
    return Screen(width=UNBOUNDED).measure(table).maximum


def _folded(
    table: Table, letters: int, width: int, omitted: Sequence[str] = ()
) -> RichTable:
    """Return a table whose words wrap, with at least these letters in a line.

    Columns share the room so that no word is cut; Rich does not ensure that.
    """
    folded = _rich_table(table, letters, omitted)
    widths, longest = dict[int, int](), dict[int, int]()
    for i, column in enumerate(folded.columns):
        if not column.no_wrap:
            cells = [visible(str(cell)) for cell in (column.header, *column.cells)]
            longest[i] = max(map(cell_len, "\n".join(cells).splitlines()), default=1)
            word = max(map(cell_len, " ".join(cells).split()), default=1)
            widths[i] = max(word, min(longest[i], letters))
            column.width = widths[i]
    for _ in range(width - _width(folded) if longest else 0):
        i = max(longest, key=lambda i: longest[i] / widths[i])
        widths[i] += widths[i] < longest[i]
        folded.columns[i].width = widths[i]
    return folded
