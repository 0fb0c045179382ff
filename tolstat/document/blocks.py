"""The blocks of a document: headings, sentences, tables, figures."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

from tolstat.document.inline import Inline, Name, Number, Parts, Said
from tolstat.document.sentences import text
from tolstat.statistics.estimate import Estimate
from tolstat.units.scale import Scale

if TYPE_CHECKING:
    from tolstat.document.plot import Plot  # a screen has no figures
    from tolstat.document.scene import Scene

PICTURES = (".png", ".svg", ".pdf")  # endings of files that hold a figure


class Sketch(NamedTuple):
    """A small histogram without axes, its bars in [0, 1] along a common width."""

    alt: str  # describes it for screen readers
    edges: tuple[float, ...]  # one more than heights
    heights: tuple[float, ...]
    out_of_limit: tuple[bool, ...]  # by bar
    ends: tuple[float, ...]  # of the limit


class Cell(NamedTuple):
    """A cell of a table: a number or words, with smaller text below."""

    main: Parts
    below: Parts = ()
    sketch: Sketch | None = None  # below that, on a page


@dataclass(frozen=True)
class Column:
    """A column of a table."""

    head: str  # the quantity, with its unit
    words: bool = False  # whether it holds sentences, which wrap
    page_only: bool = False  # whether a screen leaves it out


Given = Inline | Parts | Cell | None  # a cell as it is given


@dataclass(frozen=True)
class Table:
    """Rows of cells, as many as columns."""

    columns: tuple[Column, ...]
    rows: tuple[tuple[Cell, ...], ...]
    title: str = ""  # above it
    caption: Parts = ()  # below it
    keys: int = 1  # columns that say what a row is
    look: str = ""  # "verdicts" or "dense"
    spare: tuple[str, ...] = ()  # heads that a narrow screen leaves out, in this order

    @property
    def sides(self) -> tuple[str, ...]:
        """The content of each column: "words" that wrap, "left" names, else numbers."""
        return tuple(
            "words" if column.words else "" if any(map(_is_number, cells)) else "left"
            for column, *cells in zip(self.columns, *self.rows, strict=True)
        )

    def without(self, *heads: str) -> Table:
        """Return it without some columns, as a plain table."""
        rest = [i for i, column in enumerate(self.columns) if column.head not in heads]
        rows = (tuple(row[i] for i in rest) for row in self.rows)
        columns = tuple(self.columns[i] for i in rest)
        return replace(self, columns=columns, rows=tuple(rows), look="")


def _is_number(cell: Cell) -> bool:
    return any(isinstance(part, Number) for part in cell.main)


def table_of(
    rows: Iterable[Mapping[str, Given]],
    title: str = "",
    *,
    words: Sequence[str] = (),
    page_only: Sequence[str] = (),
    caption: Parts = (),
    keys: int = 1,
    look: str = "",
    spare: Sequence[str] = (),
) -> Table:
    """Return a table of cells by head; empty columns are left out.

    Parameters
    ----------
    rows : iterable of dict of str to cell
        A cell that is missing is empty.
    words, page_only : sequence of str
        Heads of columns of sentences, and of those that a screen leaves out.
    title, caption, keys, look, spare
        As of `Table`.
    """
    lines = [{head: cell_of(cell) for head, cell in row.items()} for row in rows]
    names = dict.fromkeys(head for line in lines for head in line)
    heads = [head for head in names if any(any(line.get(head, ())) for line in lines)]
    return Table(
        tuple(Column(head, head in words, head in page_only) for head in heads),
        tuple(tuple(row.get(head, Cell(())) for head in heads) for row in lines),
        title, caption, keys, look,
        tuple(head for head in spare if head in heads and head not in page_only),
    )  # fmt: skip


def cell_of(content: Given) -> Cell:
    """Return the cell of a content; None is empty."""
    if isinstance(content, Number | Name):  # most cells
        return Cell((content,))
    return content if isinstance(content, Cell) else Cell(text(content))


@dataclass(frozen=True)
class Paragraph:
    """A sentence or a few; `role`: "lead" at the top, "note" for small print."""

    parts: Parts
    role: str = ""


@dataclass(frozen=True)
class Bullets:
    """Sentences, one below the other; numbered if their order matters."""

    items: tuple[Parts, ...]
    numbered: bool = False


@dataclass(frozen=True)
class Facts:
    """Names and their values; `role` "sheet": the title block."""

    rows: tuple[tuple[str, Parts], ...]
    role: str = ""


@dataclass(frozen=True)
class Verbatim:
    """A text as it was written."""

    text: str


@dataclass(frozen=True)
class Figure:
    """A picture, as data; `alt` describes it for screen readers."""

    alt: str
    picture: Plot
    caption: Parts = ()
    wide: bool = False


@dataclass(frozen=True)
class Animated:
    """A picture that moves, as data; `alt` describes it for screen readers."""

    alt: str
    scene: Scene


@dataclass(frozen=True)
class Gallery:
    """Figures side by side."""

    figures: tuple[Figure, ...]


class Tile(NamedTuple):
    """One large number or word under its label, with its interval below it."""

    label: Parts
    cell: Cell


@dataclass(frozen=True)
class Tiles:
    """The most important numbers, side by side."""

    tiles: tuple[Tile, ...]


@dataclass(frozen=True)
class Columns:
    """Blocks in two columns; on a phone one below the other."""

    left: tuple[Block, ...]
    right: tuple[Block, ...]


class Range(NamedTuple):
    """An estimate against its level, SI; `tone`: its verdict."""

    name: str
    found: Estimate
    level: float
    tone: str


@dataclass(frozen=True)
class Ranges:
    """Intervals against a level, one below the other, along a logarithmic axis."""

    alt: str  # describes it for screen readers
    rows: tuple[Range, ...]
    scale: Scale
    level: str  # what a level is


@dataclass(frozen=True)
class Section:
    """Blocks under a heading; its level follows from the sections around it."""

    title: str  # empty for none
    blocks: tuple[Block, ...]
    anchor: str = ""  # where links to it lead; the contents of a page name it
    page_only: bool = False  # whether a screen leaves it out
    role: str = ""  # "first": a sheet of its own on paper


Block = (
    Table
    | Paragraph
    | Bullets
    | Facts
    | Verbatim
    | Figure
    | Animated
    | Gallery
    | Tiles
    | Columns
    | Ranges
    | Section
)


@dataclass(frozen=True)
class Document:
    """The document of an answer."""

    title: str
    blocks: tuple[Block, ...]
    foot: tuple[str, ...] = ()  # of each printed sheet


def figures_in(*blocks: Block) -> Iterator[Figure]:
    """Yield the figures of some blocks, and of the blocks in these."""
    for block in blocks:
        match block:
            case Figure():
                yield block
            case Gallery(figures):
                yield from figures
            case Section(blocks=inner):
                yield from figures_in(*inner)
            case Columns(left, right):
                yield from figures_in(*left, *right)


def shown(*blocks: Block | None) -> tuple[Block, ...]:
    """Return the blocks without empty ones and None."""
    return tuple(
        block for block in blocks if block is not None and not _is_empty(block)
    )


def section(
    title: str,
    *parts: Block | None,
    anchor: str = "",
    page_only: bool = False,
    role: str = "",
) -> Section:
    """Return a section of the blocks that are not empty; other fields as its own."""
    return Section(title, shown(*parts), anchor, page_only, role)


def _is_empty(block: Block) -> bool:
    match block:
        case Paragraph(()) | Bullets(()) | Section(blocks=()):
            return True
        case Table(rows=()) | Ranges(rows=()) | Tiles(()) | Columns((), ()):
            return True
    return False


def note(*parts: Said) -> Paragraph:
    """Return a note: a paragraph in small print."""
    return Paragraph(text(*parts), "note")


def paragraph(*parts: Said) -> Paragraph:
    """Return a paragraph."""
    return Paragraph(text(*parts))
