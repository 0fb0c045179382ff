"""Checks for the page of any answer: numbers, pictures, layout."""

from __future__ import annotations

import io
import json
import math
import re
import shlex
import shutil
import subprocess
from html import escape, unescape

import matplotlib.image as image
import numpy as np
import pytest
from click.testing import CliRunner

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
    figures_in,
)
from tolstat.document.inline import Number, in_cell, plain
from tolstat.render.page import page
from tolstat.render.panels import SIZE
from tolstat.render.screen import as_text


class Made:
    """An answer, its document, its page, and its figures as data."""

    def __init__(self, answer, path):
        self.answer, self.path = answer, path
        self.json = json.loads(answer.json())
        self.document = answer.document()
        self.text = page(self.document)
        figures = figures_in(*self.document.blocks)
        self.figures = [(figure.alt, figure.picture) for figure in figures]
        path.write_text(self.text, encoding="utf-8")
        self.page = Page(self.text)


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


LEADING = 3  # pixels of a box of words that are empty
WORDS = """[...document.querySelectorAll("figure svg")].map(svg => {
  const box = e => (({left, top, right, bottom}) => [left, top, right, bottom])(
    e.getBoundingClientRect());
  const words = [...svg.querySelectorAll("text")].map(e => [e.textContent, box(e)]);
  return [svg.getAttribute("aria-label"), box(svg), words];
})"""


def no_words_lie_over_others(made):
    """Nor beyond the picture, as a browser draws them."""
    pictures = asked(made.path, made.path.parent, 1200, WORDS)
    assert len(pictures) == len(made.figures)
    for name, edge, boxes in pictures:
        for i, (words, box) in enumerate(boxes):
            assert box[0] > edge[0] - 1 and box[1] > edge[1] - 1, (name, words)
            assert box[2] < edge[2] + 1 and box[3] < edge[3] + 1, (name, words)
            for other, there in boxes[i + 1 :]:
                apart = (
                    box[2] <= there[0] + 1 or there[2] <= box[0] + 1
                    or box[3] <= there[1] + LEADING or there[3] <= box[1] + LEADING
                )  # fmt: skip
                assert apart, (name, words, other)


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
    assert found["pictures"] * 72 / 96 * SIZE >= 8
    assert {*found["heads"]} == {"avoid"}
    drawn = [p for p in made.page.pictures if p.get("class") != "sketch"]
    assert all(f"font:{SIZE}px" in picture["style"] for picture in drawn)
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
