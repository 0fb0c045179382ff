"""The page of a rare run: numbers, commands, layout on a phone."""

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
    rows_out_of_sight_make_no_row_high_on_a_phone,
    the_command_runs,
    the_page_is_as_wide_as_its_window,
    the_page_needs_nothing_else,
    tidy_finds_nothing,
    words_in,
)
from tolstat.answers.rare.rare_answer import rare_summary
from tolstat.document.blocks import Paragraph
from tolstat.document.inline import Number, in_line
from tolstat.render.screen import as_text


@pytest.fixture(scope="module")
def rare(tmp_path_factory):
    folder = tmp_path_factory.mktemp("rare")
    limit = {"limit": "2416.30..2417.04 mm", "ppm": 100}
    run = tolstat.run(chain(limit, sampling="rare"), output=folder / "rare.h5")
    return Made(rare_summary(run), folder / "rare.html")


def test_the_page_of_a_rare_run_is_complete(rare, tmp_path):
    every_number_is_one_of_the_answer(rare, least=60)
    the_page_needs_nothing_else(rare)
    tidy_finds_nothing(rare.path)
    the_page_is_as_wide_as_its_window(rare, tmp_path)


def test_pictures_show_the_tail_and_the_failure_point(rare):
    answer = rare.answer
    (curve, *_) = answer.plot("Fraction of gap").axes[0].lines
    values, ppm = curve.get_data()
    lower, upper = (1e3 * end for end in answer.limit.permitted)
    assert (values < lower).all() or (values > upper).all()
    share = answer.fraction_out_of_limit
    assert share.value / 2 <= 1e-6 * max(ppm) <= share.value * (1 + 1e-9)
    assert sorted(ppm, reverse=True) == [*ppm] or sorted(ppm) == [*ppm]
    bars = answer.plot("Most probable failure point").axes[0].patches
    scores = sorted(answer.failure_points[0].scores.values(), key=abs, reverse=True)
    assert [bar.get_xy()[1, 0] for bar in bars] == pytest.approx(scores)


def test_hidden_rows_do_not_raise_row_height_on_a_phone(rare, tmp_path):
    others = "section:not(:has(#summary))"  # intervals below numbers
    rows_out_of_sight_make_no_row_high_on_a_phone(rare.path, tmp_path, 40, others)
    rows_out_of_sight_make_no_row_high_on_a_phone(rare.path, tmp_path, 60)


def test_what_if_rows_are_not_high_on_a_phone(tmp_path):
    path = tmp_path / "w.html"
    run = tolstat.run(chain("<= 2416.9 mm"), output=tmp_path / "run.h5")
    path.write_text(tolstat.what_if(run, {"H": "+-0.1 mm"}).html())
    rows_out_of_sight_make_no_row_high_on_a_phone(path, tmp_path, 60)


def test_a_limit_wraps_only_after_its_dots_on_a_phone(rare, tmp_path):
    lines = (
        "[...document.querySelectorAll('td:nth-child(2) > .whole')].map(e => {"
        " const line = document.createRange(), tops = [...e.childNodes].flatMap(n => {"
        " if (n.nodeType != 3) return [];"
        " return [...n.data].map((c, i) => { line.setStart(n, i);"
        " line.setEnd(n, i + 1); return [c, line.getBoundingClientRect().top] }) });"
        " return tops.map(([c, t], i) => (i && t > tops[i - 1][1] ? '|' : '') + c)"
        ".join('') })"
    )
    words = "2416.30..<wbr>2417.04 mm"
    assert f'class="whole">{words}</span>' in rare.text
    for limit in (
        "0.075..0.3 / 3 mm",
        "2416.30..2417.04 mm",
        "12345.678..12345.789 mm",
    ):
        marked = limit.replace("..", "..<wbr>")
        (tmp_path / "own.html").write_text(rare.text.replace(words, marked))
        broken = asked(tmp_path / "own.html", tmp_path, 390, lines)[0]
        assert broken.replace("|", "") == limit
        assert all(part[-1] in ". " for part in broken.split("|")[:-1]), broken


def yield_of(found):
    """The yield as it is said; None where it is not."""
    for block in blocks_of(found.document()):
        if isinstance(block, Paragraph) and as_text(block.parts).startswith("Yield: "):
            (number,) = (part for part in block.parts if isinstance(part, Number))
            return number
    return None


def test_a_rare_yield_is_not_printed_as_100_per_cent(rare):
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


def test_commands_on_the_page_run_in_its_folder(tmp_path, monkeypatch):
    """The run is named as it was given, and quoted for a shell."""
    monkeypatch.chdir(tmp_path)
    Path("my runs").mkdir()
    limit = {"limit": "<= 2416.9 mm", "ppm": 100}
    run = tolstat.run(chain(limit, sampling="rare"), output="my runs/gap.h5")
    the_command_runs(tolstat.report(run))


def test_screen_and_page_agree_on_kinds_that_were_not_met(rare):
    """On screen and page: they are one document."""
    words = words_in(*rare.document.blocks)
    holds = r"Interval and verdict hold for the kinds .* met\. A kind that it never met"
    (said,) = re.findall(holds + r" may make up to [^.]*\.", words)
    page = rare.page.text.replace("\u202f", "")  # long numbers are grouped there
    assert " ".join(page.split()).count(said) == 1
