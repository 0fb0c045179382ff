"""The page of a rare run: its numbers, its commands, and how it looks on a phone."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import pytest

import tolstat
from tests.answers.browser import asked
from tests.answers.conftest import chain
from tests.answers.page_checks import (
    Made,
    blocks_of,
    every_number_is_one_of_the_answer,
    the_command_runs,
    the_page_is_as_wide_as_its_window,
    the_page_needs_nothing_else,
    tidy_finds_nothing,
    words_in,
)
from tolstat.answers.rare.rare_answer import rare_summary
from tolstat.document.blocks import Paragraph
from tolstat.document.digits import in_line
from tolstat.document.inline import Number
from tolstat.render.screen import as_text


@pytest.fixture(scope="module")
def rare(tmp_path_factory):
    folder = tmp_path_factory.mktemp("rare")
    limit = {"limit": "2416.30..2417.04 mm", "ppm": 100}
    run = tolstat.run(chain(limit, sampling="rare"), output=folder / "rare.h5")
    return Made(rare_summary(run), folder / "rare.html")


def test_a_rare_page_is_whole(rare, tmp_path):
    every_number_is_one_of_the_answer(rare, least=100)
    the_page_needs_nothing_else(rare)
    tidy_finds_nothing(rare.path)
    the_page_is_as_wide_as_its_window(rare, tmp_path)


def test_rows_out_of_sight_make_no_row_high_on_a_phone(rare, tmp_path):
    """Commands and intervals stand in one line; a limit breaks behind .. alone."""
    what_if = tmp_path / "w.html"
    run = tolstat.run(chain("<= 2416.9 mm"), output=tmp_path / "run.h5")
    what_if.write_text(tolstat.what_if(run, {"H": "+-0.1 mm"}).html())
    height = "e => e.getBoundingClientRect().height"
    for page, most in ((rare.path, 40), (what_if, 60)):
        rows = f"[...document.querySelectorAll('.dense tbody tr')].map({height})"
        high = asked(page, tmp_path, 390, rows)
        assert len(high) >= 2 and max(high) <= most, page


def yield_of(found):
    """The yield as it is said; None where it is not."""
    for block in blocks_of(found.document()):
        if isinstance(block, Paragraph) and as_text(block.parts).startswith("Yield: "):
            (number,) = (part for part in block.parts if isinstance(part, Number))
            return number
    return None


def test_a_rare_yield_is_no_hundred_per_cent(rare):
    """Its line ends short of 100 %, or is left out; the ppm speak."""
    number = yield_of(rare.answer)
    assert number.value == rare.answer.within
    value, _, _, _, upper, _ = (
        each if isinstance(each, str) else float(each.text)
        for each in (each for each in in_line(number) if each != " %")
    )
    assert value < upper < 100
    near = rare.answer.within._replace(
        value=1 - 3e-13, lower=1 - 4e-13, upper=1 - 2e-13
    )
    found = replace(rare.answer, within=near)
    assert yield_of(found) is None
    words = words_in(*found.document().blocks)
    assert "A plain run would need" in words and "out of limit, ppm" in words


def test_a_command_on_a_rare_page_runs_where_the_page_was_made(tmp_path, monkeypatch):
    """The run is named as it was given, and quoted for a shell."""
    monkeypatch.chdir(tmp_path)
    Path("my runs").mkdir()
    limit = {"limit": "<= 2416.9 mm", "ppm": 100}
    run = tolstat.run(chain(limit, sampling="rare"), output="my runs/gap.h5")
    the_command_runs(tolstat.report(run))


def test_kinds_of_trials_that_were_not_met_are_said_alike(rare):
    """On screen and page: they are one document."""
    words = words_in(*rare.document.blocks)
    (said,) = re.findall(r"Interval and verdict leave out [^.]*never met[^.]*\.", words)
    assert " ".join(rare.page.text.split()).count(said) == 1
