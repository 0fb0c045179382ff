"""Arbitrary text in every medium."""

from __future__ import annotations

import csv
import io

import matplotlib as mpl
import pytest
from matplotlib.figure import Figure
from rich.table import Table

from tolstat.literal import csv_cell, visible
from tolstat.render.page import environment
from tolstat.render.picture import STYLE, picture
from tolstat.render.screen import Screen
from tolstat.render.serialize import csv_text

HOSTILE = "[/] [mm] [red]x :warning: $\\foo{ a$ <b>&\x1b[31m\u202ereversed\x07"
SHOWN = "[/] [mm] [red]x :warning: $\\foo{ a$ <b>&\\x1b[31m\\u202ereversed\\x07"


def test_visible_characters_are_kept():
    for text in (
        "rods, 2450 mm \u00b1 1 \u00b5m",
        "Stange \u00fc\u00df",
        "\u0441\u0442\u0435\u043d\u0434",
        "a\nb\tc",
        "",
    ):
        assert visible(text) == text
    assert visible(HOSTILE) == SHOWN


def test_on_the_screen():
    table = Table(title=HOSTILE)
    table.add_column(HOSTILE, no_wrap=True)
    table.add_row(HOSTILE)
    written = io.StringIO()
    screen = Screen(file=written, width=400, force_terminal=True, color_system=None)
    screen.print(HOSTILE)
    screen.print(table)
    assert written.getvalue().count(SHOWN) == 4 and "\x1b[31" not in written.getvalue()


def test_on_a_page():
    made = environment().from_string("<p>{{ x }}</p>").render(x=HOSTILE)
    assert (
        made == "<p>" + SHOWN.replace("&", "&amp;").replace("<b>", "&lt;b&gt;") + "</p>"
    )


@pytest.mark.parametrize(
    "text",
    ["=1+1", "+1", "-1", "@x", "\tx", "=cmd|' /C calc'!A0", "+-0.1", "+-3 %", "-1+A1",
     "+-1 mm|' /C calc'!A0", "+1 A(1)"],
)  # fmt: skip
def test_no_cell_is_a_formula(text):
    rows = list(csv.reader(io.StringIO(csv_text([text, "b"], [[text, -1.5]]))))
    assert rows == [[f"'{text}", "b"], [f"'{text}", "-1.5"]]
    assert csv_cell("rods") == "rods" and csv_cell(-1.0) == -1.0


def test_a_tolerance_is_no_formula():
    for text in ("+-0.1 mm", "+-1.2e-5 N m/rad^2", "-0.5 µm", "+-2 °"):
        assert csv_cell(text) == text


def test_in_pictures(tmp_path):
    """What a picture writes is well-formed XML, its words the title's."""
    from xml.etree import ElementTree

    with mpl.rc_context({**STYLE, "svg.fonttype": "none"}):
        figure = Figure()
        figure.suptitle(HOSTILE)
        (tmp_path / "title.svg").write_bytes(picture(figure, ".svg"))
    words = "".join(ElementTree.parse(tmp_path / "title.svg").getroot().itertext())
    assert SHOWN in words
