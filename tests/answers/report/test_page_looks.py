"""A report in a browser: colours, phone, paper."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

import tolstat
from tests.answers.browser import asked
from tests.answers.page_checks import (
    PAPER,
    TALL,
    on_paper_no_word_has_less_than_8_points,
    the_page_is_as_wide_as_its_window,
    the_page_is_drawn_in_light_and_in_dark,
    the_page_prints_on_a4,
    the_verdict_stays_in_sight_on_a_phone,
)
from tolstat.answers.report.full_report import report_of
from tolstat.render.page import page


def test_the_page_has_light_and_dark_colours(report, tmp_path):
    the_page_is_drawn_in_light_and_in_dark(report, tmp_path)


def test_the_page_fits_the_window(report, tmp_path):
    the_page_is_as_wide_as_its_window(report, tmp_path)


def test_the_page_prints_on_a4(report, tmp_path):
    the_page_prints_on_a4(report, tmp_path)


def test_printed_text_is_large_enough_and_page_1_is_one_page(report, tmp_path):
    first = on_paper_no_word_has_less_than_8_points(report, tmp_path)
    assert 0 < first < TALL


def test_the_picture_of_all_limits_fits_a_phone(report, tmp_path):
    over = "(e => e.scrollWidth - e.clientWidth)(document.querySelector('figure'))"
    assert asked(report.path, tmp_path, 390, over) == 0


def test_the_verdict_stays_visible_on_a_phone(report, tmp_path):
    cells = 7 * (1 + 5)
    the_verdict_stays_in_sight_on_a_phone(report.path, tmp_path, cells)
    long = report.text.replace("&lt;= 3 %", "-1234.567 .. 1234.567 kN m")
    assert long != report.text
    (tmp_path / "long.html").write_text(long)
    the_verdict_stays_in_sight_on_a_phone(tmp_path / "long.html", tmp_path, cells)


def test_hidden_sentences_do_not_raise_row_height_on_a_phone(report, tmp_path):
    tables = "[...document.querySelectorAll('#assumptions ~ .table tbody tr')]"
    height = "e => e.getBoundingClientRect().height"
    high = asked(report.path, tmp_path, 390, f"{tables}.map({height})")
    assert len(high) == 20 and max(high) <= 75


@pytest.mark.parametrize("limits", [3, 30])
def test_the_first_page_is_one_sheet(limits, tmp_path):
    study = tomllib.loads(Path("runs/gaps.toml").read_text())
    for number in range(limits - 3):
        study["gaps"][f"more_{number}"] = "housing - stack"
        study["limits"][f"more_{number}"] = "0.25..0.6 mm"
    run = tolstat.run(study, trials=500, output=tmp_path / "run.h5")
    path = tmp_path / "gaps.html"
    report = report_of(run, [next(iter(run.limits))])  # sections of others cost time
    path.write_text(page(report.document()))
    bottom = "document.querySelector('.first').getBoundingClientRect().bottom"
    assert 0 < asked(path, tmp_path, int(PAPER) + 1, bottom, paper=True) < TALL
