"""The page of a comparison: checks of every page, and safe text."""

from __future__ import annotations

import pytest

import tolstat
from tests.answers.browser import Page
from tests.answers.hostile_names import HOSTILE, Quoted
from tests.answers.page_checks import (
    Made,
    a_ppk_without_interval_stands_as_small_as_its_reason,
    every_number_is_one_of_the_answer,
    every_picture_has_words_and_names_of_its_own,
    no_words_lie_over_others,
    on_paper_no_word_has_less_than_8_points,
    table_under,
    the_page_is_as_wide_as_its_window,
    the_page_is_drawn_in_light_and_in_dark,
    the_page_needs_nothing_else,
    the_page_prints_on_a4,
    the_verdict_stays_in_sight_on_a_phone,
    tidy_finds_nothing,
)


@pytest.fixture(scope="module")
def comparison(mill, linked, tmp_path_factory):
    found = tolstat.compare(mill, linked)
    return Made(found, tmp_path_factory.mktemp("page") / "comparison.html")


def test_every_printed_number_is_in_the_answer(comparison):
    every_number_is_one_of_the_answer(comparison)


def test_a_ppk_without_interval_is_as_small_as_its_reason(comparison):
    (less,) = comparison.answer.differences
    limits = [each.limit for each in less.responses.values() if each.limit]
    table = table_under(comparison.document, "Out of limit, and equivalent Ppk")
    a_ppk_without_interval_stands_as_small_as_its_reason(
        table.rows, comparison.text, [(each.moments_ppk_difference,) for each in limits]
    )


def test_the_page_is_self_contained(comparison):
    the_page_needs_nothing_else(comparison)


def test_every_picture_has_alt_text_and_unique_ids(comparison):
    every_picture_has_words_and_names_of_its_own(comparison)


def test_no_texts_overlap(comparison):
    no_words_lie_over_others(comparison)


def test_tidy_finds_no_error(comparison):
    tidy_finds_nothing(comparison.path)


def test_the_page_has_light_and_dark_colours(comparison, tmp_path):
    the_page_is_drawn_in_light_and_in_dark(comparison, tmp_path)


def test_the_page_fits_the_window(comparison, tmp_path):
    the_page_is_as_wide_as_its_window(comparison, tmp_path)


def test_the_page_prints_on_a4(comparison, tmp_path):
    the_page_prints_on_a4(comparison, tmp_path)


def test_printed_text_has_at_least_8_points(comparison, tmp_path):
    on_paper_no_word_has_less_than_8_points(comparison, tmp_path)


def test_the_verdict_stays_visible_on_a_phone(comparison, tmp_path):
    cells = 5 * (1 + 2 * 5)
    the_verdict_stays_in_sight_on_a_phone(comparison.path, tmp_path, cells)
    long = comparison.text.replace("&lt;= 3 %", "-1234.567 .. 1234.567 kN m")
    assert long != comparison.text
    (tmp_path / "long.html").write_text(long)
    the_verdict_stays_in_sight_on_a_phone(tmp_path / "long.html", tmp_path, cells)


def test_texts_of_a_study_are_escaped(toy_study, tmp_path):
    title = HOSTILE.replace('"', '\\"')
    text = toy_study.read_text().replace('title = "toy"', f'title = "{title}"')
    toy_study.write_text(text)
    named = tmp_path / "a \"b\" <i>'c'.h5"
    run = tolstat.run(toy_study, model=Quoted(), output=named)
    page = tolstat.compare(run, run).html()
    assert "<script" not in page and HOSTILE in Page(page).text
    assert not {"script", "i", "b"} & set(Page(page).tags)
