"""Checks for the page of any answer: numbers, pictures, layout."""

from __future__ import annotations

import io
import json
import math
import re
import shlex
import shutil
import subprocess
from contextlib import contextmanager
from html import escape, unescape

import matplotlib.image as image
import numpy as np
import pytest
from click.testing import CliRunner
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Text

from tests.answers.browser import Page, asked, look, printed, scroll_widths
from tolstat.answers.report.first_page import first_page
from tolstat.cli.main import main
from tolstat.document.blocks import (
    Bullets,
    Columns,
    Facts,
    Figure,
    Gallery,
    Paragraph,
    Ranges,
    Section,
    Table,
    Tiles,
    Verbatim,
)
from tolstat.document.inline import Number, in_cell, plain
from tolstat.render import figures
from tolstat.render.page import page
from tolstat.render.picture import SMALLEST
from tolstat.render.screen import as_text


class Made:
    """An answer, its document, its page, and the figures that were drawn for it."""

    def __init__(self, answer, path):
        self.answer, self.path = answer, path
        self.json = json.loads(answer.json())
        self.document = answer.document()
        with drawn() as self.figures:
            self.text = page(self.document)
        path.write_text(self.text, encoding="utf-8")
        self.page = Page(self.text)


@contextmanager
def drawn():
    """Keep what is drawn, with its words."""
    kept, original = [], figures.inline

    def keep(figure, alternative):
        kept.append((alternative, figure))
        return original(figure, alternative)

    figures.inline = keep
    try:
        yield kept
    finally:
        figures.inline = original


def blocks_of(document):
    """All blocks of a document, those of its sections among them."""
    left = list(document.blocks)
    while left:
        block = left.pop(0)
        yield block
        if isinstance(block, Section):
            left[:0] = block.blocks
        if isinstance(block, Columns):
            left[:0] = block.left + block.right


def tables_of(document):
    return [each for each in blocks_of(document) if isinstance(each, Table)]


def section_of(document, title):
    """The one section of a title."""
    (found,) = (
        each
        for each in blocks_of(document)
        if isinstance(each, Section) and each.title == title
    )
    return found


def table_under(document, title):
    """The one table of a title, or the first one in the section of a title."""
    named = [each for each in tables_of(document) if each.title == title]
    return named[0] if named else tables_of(section_of(document, title))[0]


def tiles_of(document):
    """The cells of the tiles of a report, by their labels."""
    (tiles,) = (each for each in blocks_of(document) if isinstance(each, Tiles))
    return {as_text(tile.label): tile.cell for tile in tiles.tiles}


def rows_of(table):
    """What stands in each row, by the head of its column."""
    heads = [each.head for each in table.columns]
    return [dict(zip(heads, row, strict=True)) for row in table.rows]


def number_in(cell):
    """The one number of a cell, SI; None where there is none."""
    numbers = [part for part in cell.main if isinstance(part, Number)]
    assert len(numbers) <= 1
    return numbers[0].value if numbers else None


def words_in(*blocks):
    """All words of some blocks."""
    return " ".join(" ".join(_words(blocks)).split())


def _words(blocks):
    for block in blocks:
        match block:
            case Section(title=title, blocks=inner):
                yield from (title, *_words(inner))
            case Ranges(alt=alt):
                yield alt
            case Columns(left, right):
                yield from _words((*left, *right))
            case Tiles(tiles):
                for tile in tiles:
                    yield from (as_text(tile.label), words_of(tile.cell))
            case Gallery(figures=inner):
                yield from _words(inner)
            case Figure(alt=alt, caption=caption):
                yield from (alt, as_text(caption))
            case Table(title=title, columns=columns, rows=rows, caption=caption):
                yield from (title, *(each.head for each in columns))
                yield from (words_of(cell) for row in rows for cell in row)
                yield as_text(caption)
            case Paragraph(parts=parts):
                yield as_text(parts)
            case Bullets(items=items):
                yield from map(as_text, items)
            case Facts(rows=rows):
                yield from (f"{name} {as_text(parts)}" for name, parts in rows)
            case Verbatim(text=text):
                yield text


def words_of(cell):
    """What stands in a cell."""
    words = [as_text(cell.main)]
    if len(cell.main) == 1 and isinstance(cell.main[0], Number):
        words = [plain(each) for each in in_cell(cell.main[0])]
    return " ".join([*words, as_text(cell.below)])


def words_under(text, tag):
    """What stands in all elements of a kind, without their marks."""
    found = re.findall(rf"<{tag}[^>]*>(.*?)</{tag}>", text, flags=re.DOTALL)
    return [" ".join(Page(each).text.split()) for each in found]


def last_place(words):
    """Where the last figure of a printed number stands: 1.50e-4 ends at 1e-6."""
    digits, _, exponent = words.partition("e")
    decimals = len(digits.partition(".")[2])
    if not exponent and "." not in digits:  # whole: zeros may stand for nothing
        decimals = -(len(digits) - len(digits.rstrip("0")))
    return 10.0 ** (int(exponent or 0) - decimals)


def says(words, shown):
    """Whether printed words say a number."""
    if words.startswith(("below", "above")):
        return abs(shown) < abs(float(words.split()[1]))
    return abs(float(words) - shown) <= 0.501 * last_place(words) + 1e-12 * abs(shown)


def numbers_in(found):
    """All numbers of a JSON, written in full."""
    if isinstance(found, dict | list):
        for each in found.values() if isinstance(found, dict) else found:
            yield from numbers_in(each)
    elif found in ("inf", "-inf") or isinstance(found, float | int):
        yield repr(float(found) if isinstance(found, str) else found)


def every_number_is_one_of_the_answer(made, least=300):
    known = set(numbers_in(made.json))
    assert len(made.page.numbers) > least
    for value, words in made.page.numbers:
        assert value in known, words
        assert words.strip(), value


def the_page_needs_nothing_else(made):
    assert len(made.text.encode()) < 5e6
    assert "script" not in made.page.tags and "link" not in made.page.tags
    for link in made.page.links:
        assert link.startswith(("#", "data:image/png"))
    assert "http" not in re.sub(r'xmlns(:xlink)?="[^"]*"', "", made.text)


def every_picture_has_words_and_names_of_its_own(made, least=10):
    drawn = [p for p in made.page.pictures if p.get("class") != "sketch"]
    assert len(drawn) == len(made.figures) > least
    for picture in made.page.pictures:
        assert picture["role"] == "img" and len(picture["aria-label"]) > 10
    names = re.findall(r'\bid="([^"]+)"', made.text)
    assert len(names) == len(set(names))
    for name in set(re.findall(r'(?:href="#|url\(#)([^")]+)', made.text)):
        assert name in names, name


def _texts_of(figure):
    """Bounding boxes of all words of a figure."""
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    renderer = canvas.get_renderer()
    found = []
    for axes in figure.axes:
        if not axes.axison:
            continue
        shown = [axes.xaxis.label, axes.yaxis.label]
        for axis in (axes.xaxis, axes.yaxis):
            low, high = sorted(axis.get_view_interval())
            ticks = [t for t in axis.get_major_ticks() if low <= t.get_loc() <= high]
            shown += [label for t in ticks for label in (t.label1, t.label2)]
        found += [t for t in shown if t.get_text() and t.get_visible()]
    for legend in figure.legends:
        found += legend.get_texts()
    width, height = canvas.get_width_height()
    return [(t.get_text(), t.get_window_extent(renderer)) for t in found], width, height


def no_words_lie_over_others(made):
    for alternative, figure in made.figures:
        boxes, width, height = _texts_of(figure)
        for i, (words, box) in enumerate(boxes):
            assert box.x0 > -1 and box.y0 > -1, (alternative, words)
            assert box.x1 < width + 1 and box.y1 < height + 1, (alternative, words)
            for other, there in boxes[i + 1 :]:
                apart = (
                    box.x1 <= there.x0 + 1 or there.x1 <= box.x0 + 1
                    or box.y1 <= there.y0 + 1 or there.y1 <= box.y0 + 1
                )  # fmt: skip
                assert apart, (alternative, words, other)


def a_ppk_without_interval_stands_as_small_as_its_reason(rows, text, known):
    """Check Pp and Ppk in the last cells of rows; count those without interval."""
    small = 0
    for row, estimates in zip(rows, known, strict=True):
        for cell, ppk in zip(row[-len(estimates) :], estimates, strict=True):
            if ppk.sure or ppk.needs_more or not math.isfinite(ppk.value):
                assert number_in(cell) is ppk
                continue
            assert not cell.main  # the number stands with its reason
            value = re.escape(f'<span data-value="{ppk.value!r}">')
            said = re.escape(
                f"</span></span>: {escape(ppk.reason, quote=False)}</span>"
            )
            soft = r'<span class="range"><span class="whole">'
            assert re.search(f"{soft}{value}[^<]*{said}", text), ppk
            small += 1
    return small


def tidy_finds_nothing(path, *options):
    tidy = shutil.which("tidy")
    if not tidy:
        pytest.skip("no tidy on this machine")
    done = subprocess.run(
        [tidy, "-q", "-e", *options, path], capture_output=True, text=True
    )
    assert done.stderr == "" and done.returncode == 0


def _pixels(png):
    """Return an array [row, column, channel] from 0 to 1."""
    return image.imread(io.BytesIO(png), format="png")[:, :, :3]


def the_page_is_drawn_in_light_and_in_dark(made, folder):
    light = _pixels(look(made.path, folder))
    dark = _pixels(look(made.path, folder, dark=True))
    assert np.median(light) > 0.9 and np.median(dark) < 0.2
    # words and pictures stand out in both
    assert (light < 0.3).mean() > 0.01 and (dark > 0.7).mean() > 0.01


def the_page_is_as_wide_as_its_window(made, folder):
    widths = [390, 820, 1400]
    found = scroll_widths(made.path, folder, widths)
    assert all(w <= width for w, width in zip(found, widths, strict=True)), found


def the_page_prints_on_a4(made, folder):
    pdf = printed(made.path, folder)
    boxes = re.findall(rb"/MediaBox \[0 0 ([\d.]+) ([\d.]+)\]", pdf)
    assert len(boxes) >= 3
    for box in boxes:
        assert [float(side) for side in box] == pytest.approx([595, 842], abs=1.5)


PAPER, TALL = 182 / 25.4 * 96, 267 / 25.4 * 96  # what margins leave of A4, in pixels
SIZES = """(() => {
  const sizes = [], words = document.createTreeWalker(document.body, 4);
  while (words.nextNode()) {
    const of = words.currentNode.parentElement;
    if (words.currentNode.textContent.trim() && !of.closest("svg, script"))
      sizes.push(parseFloat(getComputedStyle(of).fontSize));
  }
  const pictures = [...document.querySelectorAll("figure svg")].map(
    e => e.getBoundingClientRect().width / e.viewBox.baseVal.width);
  const heads = [...document.querySelectorAll("h1, h2, h3")].map(
    e => getComputedStyle(e).breakAfter);
  const first = document.querySelector(".first");
  return {
    words: Math.min(...sizes), pictures: Math.min(...pictures), heads,
    scroll: document.documentElement.scrollWidth,
    first: first && first.getBoundingClientRect().bottom,
  };
})()"""


def on_paper_no_word_has_less_than_8_points(made, folder):
    """Nothing is wider than the paper either: all would be printed smaller then.

    Returns where the first page ends.
    """
    found = asked(made.path, folder, int(PAPER) + 1, SIZES, paper=True)
    assert found["scroll"] <= PAPER + 1
    assert found["words"] * 72 / 96 >= 8
    assert found["pictures"] * 72 / 96 * SMALLEST >= 8
    assert {*found["heads"]} == {"avoid"}
    every = [text for _, figure in made.figures for text in figure.findobj(Text)]
    assert min(text.get_fontsize() for text in every if text.get_text()) >= SMALLEST
    return found["first"]


def the_verdict_stays_in_sight_on_a_phone(path, folder, cells):
    """Whatever its words are: no column is as wide as these."""
    found = "[...document.querySelectorAll('.verdicts th, .verdicts td')]"
    ends = asked(
        path, folder, 390,
        f"{found}.map(e => [e.getBoundingClientRect().right, e.scrollWidth"
        " - e.clientWidth, getComputedStyle(e).display])",
    )  # fmt: skip
    seen = [end for end in ends if end[2] != "none"]
    assert len(seen) == cells
    assert max(end for end, _, _ in seen) <= 390 - 8
    assert max(over for _, over, _ in seen) <= 1


def the_command_runs(found):
    """Run the first `tolstat trial` of a page."""
    page = unescape(found.html())
    program, *words = shlex.split(re.search("<code>(tolstat trial.*?)</code>", page)[1])
    done = CliRunner().invoke(main, words)
    assert program == "tolstat" and words[1] == "my runs/gap.h5"
    assert done.exit_code == 0 and "bit for bit as stored" in done.output


def rows_out_of_sight_make_no_row_high_on_a_phone(path, folder, most, where=""):
    """Commands and intervals of a dense table stand in one line."""
    height = "e => e.getBoundingClientRect().height"
    rows = f"[...document.querySelectorAll('{where} .dense tbody tr')].map({height})"
    high = asked(path, folder, 390, rows)
    assert len(high) >= 2 and max(high) <= most


def steps_of(found):
    """What the first page says to do next."""
    for block in first_page(found):
        if isinstance(block, Section) and block.title == "What to do next":
            return [as_text(item) for item in block.blocks[0].items]
    return []
