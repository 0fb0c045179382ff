"""Small hostile documents in every medium: no text is cut or executed."""

from __future__ import annotations

import csv
import io
import json
import math
import re
import shutil
import subprocess
from dataclasses import dataclass
from html import unescape
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from tests.answers.browser import Page, violations
from tests.render.made_tables import table
from tolstat.answers.answer import Answer
from tolstat.document.blocks import (
    Bullets,
    Cell,
    Column,
    Document,
    Facts,
    Figure,
    Gallery,
    Paragraph,
    Range,
    Ranges,
    Section,
    Table,
    Verbatim,
    note,
    paragraph,
)
from tolstat.document.inline import Link, Name, Number, Typed, Word
from tolstat.document.plot import (
    Bars,
    Histogram,
    Intervals,
    Plot,
    PlotAxis,
    PlotPanel,
    curve,
)
from tolstat.document.sentences import counted, listed, text
from tolstat.model.view import Band, Level, Region, Span
from tolstat.render.drawing import as_svg
from tolstat.render.figures import draw
from tolstat.render.page import page
from tolstat.render.picture import picture
from tolstat.render.screen import show
from tolstat.statistics.estimate import Estimate
from tolstat.units.scale import PPM, Scale

HOSTILE = "[/] [red]x :warning: $\\foo{ a$ <b>&\"' \x1b[31m\u202ereversed\x07</style>"
SHOWN = "[/] [red]x :warning: $\\foo{ a$ <b>&\"' \\x1b[31m\\u202ereversed\\x07</style>"
LONG = "a_name_" * 12 + "end"
LONG_RUN = Typed(("run", f"{LONG}.toml", "--trials", 100))
KN_M = Scale("N m", "kN m")
NAN = math.nan
ESTIMATES = {
    "sure": Estimate(3100.0, 2900.0, 3300.0),
    "at least": Estimate(3100.0, 2900.0, math.inf),
    "at most": Estimate(3100.0, -math.inf, 3300.0),
    "no interval": Estimate(3100.0, NAN, NAN, "the trials are too few"),
    "none": Estimate(NAN, NAN, NAN, "no trial is done"),
    "infinite": Estimate(math.inf, NAN, NAN, "no spread"),
    "a point": Estimate(3100.0, 3100.0, 3100.0),
}
X = np.linspace(0.1, 1.0, 8)


def panel(*layers, y="y " + HOSTILE, **more):
    return PlotPanel(PlotAxis("x " + HOSTILE), PlotAxis(y), layers, **more, at=X)


LAYERS = (
    Span(0.2, 0.3, HOSTILE), Region(HOSTILE, "1", X, X, "first"),
    Band(HOSTILE, "1", X, 2 * X, colour="second"),
    Band("_" + HOSTILE, "1", X, 2 * X, colour="third", bars=True),
    curve(X, X, name=HOSTILE), curve(X, X, "fourth", HOSTILE, "rings"),
    Level(0.5, HOSTILE),
)  # fmt: skip
PLOTS = {
    "curves": Plot((panel(*LAYERS, title=HOSTILE),), width=8, height=4, legends=True),
    "axes": Plot(
        (
            PlotPanel(PlotAxis("x", words=(HOSTILE, LONG)), PlotAxis("y", "log"),
                      (curve(np.array([0.0, 1.0]), X[:2], name="_a", look="dotted"),),
                      right=panel(curve(X, X, name="right"))),
        ), width=8, height=4, legends=True,
    ),
    "bars": Plot(
        (panel(Bars((HOSTILE, LONG), X[:2], np.array([X[:2], X[1:3]]), name="bars")),)
    ),
    "histograms": Plot(
        tuple(
            panel(Histogram(np.append(X, 1.1), 1 + X, name=HOSTILE),
                  Intervals(X[:1], X[1:2], X[:1], name="median"))
            for _ in range(2)
        ), side_by_side=True, width=7,
    ),
    "normal": Plot(
        (
            PlotPanel(PlotAxis("x", "symlog"), PlotAxis("%", "normal"),
                      (curve(X, np.linspace(0.01, 0.99, 8), look="faint"),)),
        ),
    ),
}  # fmt: skip


def rows():
    """Every kind of estimate, with a hostile and a long name."""
    for name, each in ESTIMATES.items():
        yield (
            Cell((Name(f"{name} {HOSTILE}"),), text(HOSTILE)), Number(each, KN_M),
            Number(each.value, KN_M), text("in a line: ", Number(each, KN_M)),
            Number(len(name)), None,
        )  # fmt: skip


COLUMNS = (
    "response", "moment, kN m", "value, kN m", Column("sentence", words=True),
    "letters", Column("for pages " + HOSTILE, page_only=True),
)  # fmt: skip


def document(*, figures=False):
    """Everything that a document may hold."""
    blocks = [
        Paragraph(text(Word("not met", "not met"), ": ", Name(LONG, "long")), "lead"),
        note(HOSTILE),
        table(COLUMNS, rows(), HOSTILE, caption=text("caption ", HOSTILE)),
        table(("empty", "table"), []),
        Section(
            HOSTILE,
            (
                Bullets((text("type ", LONG_RUN),
                         text(HOSTILE))),
                Facts(((HOSTILE, text(HOSTILE)),)), Facts((("a", ()),), "sheet"),
                Verbatim(HOSTILE),
                paragraph(Link(HOSTILE, 'a "b"<c>.html'), counted(2, "trial")),
                paragraph(listed([HOSTILE, (Number(5e-6, PPM), " of all"), Word("x")])),
            ),
            "long",
        ),
    ]  # fmt: skip
    if figures:
        some = [Figure(HOSTILE, plot, text(HOSTILE)) for plot in PLOTS.values()]
        blocks.append(Gallery(tuple(some)))
    ranges = (Range(HOSTILE, each, 3000.0, "met") for each in ESTIMATES.values())
    blocks.append(Ranges(HOSTILE, tuple(ranges), KN_M, HOSTILE))
    return Document(HOSTILE, tuple(blocks), ("foot", HOSTILE))


def on_screen(capsys, monkeypatch, columns, what=None):
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("COLUMNS", str(columns))
    show(what or document())
    out = capsys.readouterr().out
    return re.sub(r"\x1b\[[\d;]*m", "", out)


@pytest.mark.parametrize("columns", [40, 80, 120, 400])
def test_the_screen_truncates_and_executes_no_text(capsys, monkeypatch, columns):
    shown = on_screen(capsys, monkeypatch, columns)
    assert not set("\x1b\u202e\x07…") & set(shown)
    copied = shown.replace(" \\\n     ", " ")  # as a shell reads a long command
    assert LONG in shown and f"   tolstat run {LONG}.toml --trials 100\n" in copied
    # no number is parted from its unit or its digits
    for whole in ("3.10 kN m (2.90 to 3.30)", "at least 2.9", "at most 3.3", "3.1"):
        assert whole in shown or whole in " ".join(shown.split()), whole
    assert "2.90 to 3.30" in shown and "no trial is done" in shown
    if columns == 400:
        assert shown.count(SHOWN) >= 8 + len(ESTIMATES)
    assert "for pages" not in shown
    # words are cut at spaces alone
    said = " ".join(shown.split())
    assert "reversed\\x07</style>" in said


@pytest.mark.parametrize("columns", [40, 80, 120])
def test_a_table_fits_the_width_of_the_screen(capsys, monkeypatch, columns):
    some = table(
        ("name", "moment, kN m", Column("why", words=True), *"abcdefgh"),
        [
            ("r", Number(ESTIMATES["sure"], KN_M), "words that wrap " * 9,
             *[Number(1e5)] * 8)
        ],
        "title",
    )  # fmt: skip
    shown = on_screen(capsys, monkeypatch, columns, Document("", (some,)))
    assert max(map(len, shown.splitlines())) <= columns
    assert ("\n  moment, kN m: 3.10 (2.90 to 3.30)\n" in shown) == (columns < 120)
    assert shown.count("100000") == 8 and "2.90 to 3.30" in shown
    assert shown.count("wrap") == 9


def test_a_row_by_itself_has_each_head_in_one_line(capsys, monkeypatch):
    heads = ("trial", "rod_length_1\nmm", "status")
    some = table(heads, [("7", Number(1.1), "done " * 9), ("8", None, "failed")])
    shown = on_screen(capsys, monkeypatch, 40, Document("", (some,)))
    assert shown.splitlines() == [
        "7", "  rod_length_1, mm: 1.1", "  status: done done done done done done",
        "    done done done", "8", "  status: failed",
    ]  # fmt: skip


def test_a_page_is_valid_and_has_the_same_text(tmp_path):
    made = page(document(figures=True))
    assert "\x1b" not in made and "\u202e" not in made and "\x07" not in made
    assert "<b>" not in made and "</style>x" not in made
    assert made.count("</style>") == 1
    words = unescape(re.sub(r"<(style|svg).*?</\1>|<wbr>", "", made, flags=re.DOTALL))
    assert words.count(SHOWN) > len(ESTIMATES) + 8
    assert f"tolstat run {LONG}.toml --trials 100" in words
    assert 'data-value="3100.0">3.10</span>' in made
    assert made.count("<svg") == len(PLOTS)
    assert 'href="a%20%22b%22%3Cc%3E.html"' in made
    if not (tidy := shutil.which("tidy")):
        pytest.skip("no tidy on this machine")
    path = tmp_path / "page.html"
    path.write_text(made, encoding="utf-8")
    found = subprocess.run(
        [tidy, "-q", "-e", "-utf8", "--drop-empty-elements", "no", path],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    wrong = [
        line for line in found.stderr.splitlines()
        if "proprietary attribute" not in line  # of SVG and of data for programs
        and "not recognized" not in line and "lacks \"summary\"" not in line
    ]  # fmt: skip
    assert "Error" not in found.stderr, wrong


def test_axe_finds_no_violation_in_any_block(tmp_path):
    path = tmp_path / "page.html"
    path.write_text(page(document()), encoding="utf-8")
    assert violations(path, tmp_path) == []


def test_numbers_stay_whole_on_a_page():
    made = page(document())
    (cell,) = re.findall(r'<span class="whole">[^§]*?kN m[^§]*?</span></td>', made)[:1]
    assert cell.startswith('<span class="whole"><span data-value="3100.0">')
    assert "inf" not in re.sub(r"infinite|data-value=\"-?inf\"", "", made)
    assert "nan" not in re.sub(r'data-value="nan"', "", made)


def test_long_numbers_are_grouped_on_a_page_and_typed_as_on_the_screen(capsys):
    sizes = 1234, 12345.0, 1234567, 0.123456, 1.234567e-8, -98765.4321
    said = paragraph([(Number(each), "; ") for each in sizes])
    made = page(Document("", (said,)))
    told = [words for _, words in Page(made).numbers]
    assert "<bdi>1.23e-8</bdi>" in made  # never parted at its sign
    groups = ["12 345", "1 234 567"]
    assert told == [
        "1234", *(each.replace(" ", "\u202f") for each in groups), "0.1235",
        "1.23e-8", "-98\u202f765",
    ]  # fmt: skip
    show(Document("", (said,)))
    assert "12345; 1234567" in capsys.readouterr().out


@pytest.mark.parametrize("name", PLOTS)
@pytest.mark.parametrize("ending", ["svg", "png"])
def test_a_figure_with_hostile_labels_is_drawn(tmp_path, name, ending):
    path = tmp_path / f"figure.{ending}"
    path.write_bytes(picture(draw(PLOTS[name], HOSTILE), path.suffix))
    assert path.stat().st_size > 3000
    svg = as_svg(PLOTS[name], HOSTILE)
    root = ElementTree.fromstring(svg.replace("xlink:", ""))
    assert root.get("aria-label") == SHOWN


@dataclass(frozen=True, repr=False)
class Small(Answer):
    """An answer whose numbers are of every kind."""

    found: dict[str, Estimate]
    words: str
    answers = "small"
    index = "name"

    @property
    def _short(self):
        return self.words

    def document(self):
        return Document(self.words, (table(COLUMNS, rows()),))

    def rows(self):
        return [
            {"name": f"={name}", "moment [unit]": Number(each, KN_M),
             "unit": KN_M.mark, "n": 3, "+1": self.words}
            for name, each in self.found.items()
        ]  # fmt: skip


@pytest.fixture
def small():
    return Small(ESTIMATES, HOSTILE)


def test_csv_has_no_formula_and_every_digit(small):
    told = list(csv.DictReader(io.StringIO(small.csv())))
    heads = ["name", "moment [unit]", "moment lower [unit]", "moment upper [unit]"]
    assert list(told[0]) == [*heads, "moment reason", "unit", "n", "'+1"]
    first, *_ = told
    assert [first[each] for each in heads] == ["'=sure", "3.1", "2.9", "3.3"]
    assert told[4]["moment [unit]"] == "" and told[1]["moment upper [unit]"] == "inf"
    assert first["'+1"] == SHOWN


def test_json_has_no_nan_or_infinity(small):
    found = json.loads(small.json())
    assert found["schema"] == 3 and found["answer"] == "small"
    assert found["words"] == HOSTILE
    kept = found["found"]
    assert kept["sure"] == {"value": 3100, "lower": 2900, "upper": 3300, "reason": ""}
    assert kept["at least"]["upper"] == "inf" and kept["at most"]["lower"] == "-inf"
    assert kept["none"]["value"] is None and kept["none"]["reason"]


def test_a_frame_and_files_of_an_answer(small, tmp_path):
    frame = small.frame()
    assert frame["moment"].iloc[0] == 3100.0 and frame.index[0] == "=sure"
    for ending in ("html", "csv", "json"):
        assert small.save(tmp_path / f"small.{ending}").stat().st_size > 100
    shown = small._repr_html_()
    assert shown.startswith("<iframe") and shown.count('"') == 10
    assert repr(small) == f"<tolstat small: {HOSTILE}>"


def test_a_table_knows_which_columns_hold_numbers():
    made = table(COLUMNS, rows())
    assert made.sides == ("left", "", "", "words", "", "left")
    assert isinstance(made, Table) and made.rows[0][-1] == Cell(())


def test_styles_of_a_page_only_set_layout():
    """No word of an answer stands in a template."""
    template = Path("tolstat/render/templates/document.html").read_text()
    words = re.sub(r"\{[{%#].*?[}%#]\}|<[^>]*>", "", template, flags=re.DOTALL)
    assert set(words.split()) <= {"Contents"}
