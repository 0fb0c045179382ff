"""The page of a comparison.

To be adapted: written for the page that came before documents. `make_comparison_page`,
`plain` and `data-path` are gone with it; the fixture becomes
`Made(tolstat.compare(mill.path, linked.path), path)`. What holds for every page is
called already, of tests/answers/page_checks.py. Until then nothing here runs.
"""

from __future__ import annotations

import re

import numpy as np
import pytest

import tolstat
from tests.answers.browser import Page
from tests.answers.page_checks import (
    Made,
    every_number_is_one_of_the_answer,
    every_picture_has_words_and_names_of_its_own,
    no_words_lie_over_others,
    on_paper_no_word_has_less_than_8_points,
    the_page_is_as_wide_as_its_window,
    the_page_is_drawn_in_light_and_in_dark,
    the_page_needs_nothing_else,
    the_page_prints_on_a4,
    the_verdict_stays_in_sight_on_a_phone,
    tidy_finds_nothing,
    words_under,
)
from tests.answers.report.test_page_words import HOSTILE, Quoted

pytestmark = pytest.mark.skip("the comparison becomes a document")
compared_with_first = make_comparison_page = rows_of = None  # of the old page


@pytest.fixture(scope="module")
def comparison(mill, linked, tmp_path_factory):
    found = tolstat.compare(mill.path, linked.path)
    return Made(found, tmp_path_factory.mktemp("page") / "comparison.html")


def test_the_page_holds_what_every_page_does(comparison):
    every_number_is_one_of_the_answer(comparison)
    the_page_needs_nothing_else(comparison)
    every_picture_has_words_and_names_of_its_own(comparison)
    no_words_lie_over_others(comparison)
    tidy_finds_nothing(comparison.path)


def test_the_page_looks_as_every_page_does(comparison, tmp_path):
    the_page_is_drawn_in_light_and_in_dark(comparison, tmp_path)
    the_page_is_as_wide_as_its_window(comparison, tmp_path)
    the_page_prints_on_a4(comparison, tmp_path)
    on_paper_no_word_has_less_than_8_points(comparison, tmp_path)


def test_the_verdict_stays_in_sight_on_a_phone(comparison, tmp_path):
    cells = 5 * (1 + 2 * 5)
    the_verdict_stays_in_sight_on_a_phone(comparison.path, tmp_path, cells)
    long = comparison.text.replace("&lt;= 3 %", "-1234.567 .. 1234.567 kN m")
    assert long != comparison.text
    (tmp_path / "long.html").write_text(long)
    the_verdict_stays_in_sight_on_a_phone(tmp_path / "long.html", tmp_path, cells)


def test_a_ppk_that_no_interval_holds_stands_as_small_as_its_reason(comparison):
    """As a_ppk_without_interval_stands_as_small_as_its_reason of page_checks."""
    of, small = "ppk_more_by_moments", set()
    for path, _, words in comparison.page.numbers:
        if path.endswith(f"{of}/value"):
            ppk = at(comparison.json, path.removesuffix("/value"))
            before = comparison.text[: comparison.text.index(f'data-path="{path}"')]
            soft = re.search(r'<span class="range"><span [^<]*$', before) is not None
            assert soft == (ppk["lower"] is None), path
            assert not soft or f"{words}</span>: {ppk['reason']}" in comparison.text
            small.add(soft)
    assert True in small


def at(found, path):
    for key in path.split("/"):
        found = found[int(key)] if isinstance(found, list) else found[key]
    return found


def test_each_difference_stands_under_its_head(comparison):
    rows = rows_of(comparison.text, "<h2>Differences")
    heads = ["smaller/value", "larger/value", "difference/mean/value"]
    for name, row in zip(comparison.json["responses"], rows, strict=True):
        path = f"responses/{name}"
        assert row[:4] == [f"{path}/{h}" for h in [*heads, "difference/least"]]
        assert row[-1] == f"{path}/difference/largest"


def test_texts_of_a_study_are_escaped(toy_study, tmp_path):
    title = HOSTILE.replace('"', '\\"')
    text = toy_study.read_text().replace('title = "toy"', f'title = "{title}"')
    toy_study.write_text(text)
    named = tmp_path / "a \"b\" <i>'c'.h5"
    run = tolstat.run(toy_study, model=Quoted(), output=named)
    page = make_comparison_page(*compared_with_first([run, run]))
    assert "<script" not in page and HOSTILE in Page(page).text
    assert not {"script", "i", "b"} & set(Page(page).tags)


def test_captions_of_a_comparison_count_each_design_or_both(toy, toy_study, tmp_path):
    """B fails where the second part is long too."""

    class Other(type(toy)):
        def evaluate(self, deviations, settings):
            outcome = super().evaluate(deviations, settings)
            long = deviations[:, 1] > 0.8e-3
            return outcome._replace(status=np.where(long, 4, outcome.status))

    A = tolstat.run(toy_study, model=toy, output=tmp_path / "A.h5")
    B = tolstat.run(toy_study, model=Other(), output=tmp_path / "B.h5")
    page = make_comparison_page(*compared_with_first([A, B]))
    both = np.count_nonzero((A.status == 1) & (B.status == 1))
    assert 0 < A.failed < B.failed == 1000 - both
    each = "; ".join(
        f"{name}: {run.counts['done']} trials done, {run.failed} failed"
        for name, run in (("A", A), ("B", B))
    )
    differences = f"{both} trials done in A and in B, {1000 - both} failed in either"
    assert words_under(page, "caption") == [each, differences, differences, each]
    figures = words_under(page, "figcaption")
    assert (
        f"The {both} that are done in both; {1000 - both} failed in either"
        in figures[0]
    )
