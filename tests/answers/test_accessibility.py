"""Pages for keyboards and screen readers: axe-core and an order of headings."""

from __future__ import annotations

import re
from itertools import pairwise

import pytest

from tests.answers.browser import Page, asked, violations
from tests.answers.every_page import pages
from tests.answers.page_checks import tidy_finds_nothing

KINDS = (
    "allocate", "batch", "cases", "compare", "covers", "explore", "grid",
    "index", "moving", "other", "parts", "rare", "relimit", "scenarios", "stack",
    "what-if",
)  # fmt: skip


@pytest.fixture(scope="module")
def every(tmp_path_factory):
    folder = tmp_path_factory.mktemp("every_page")  # .ci/run looks for it
    made = {path.stem: path for path in pages(folder)}
    assert tuple(made) == KINDS
    return made


@pytest.mark.parametrize("kind", KINDS)
def test_axe_finds_no_violation(every, kind, tmp_path):
    assert violations(every[kind], tmp_path, dark=kind in ("stack", "covers")) == []


@pytest.mark.parametrize("kind", KINDS)
def test_headings_and_tables_are_those_of_a_screen_reader(every, kind):
    text = every[kind].read_text(encoding="utf-8")
    levels = [int(level) for level in re.findall(r"<h(\d)", text)]
    assert levels[0] == levels.count(1) == 1
    for above, below in pairwise(levels):
        assert below <= above + 1
    assert Page(text).tags.count("main") == 1
    assert not re.search(r"<th[^>]*></th>", text)
    regions = re.findall(r'<div class="table"[^>]*role="region"[^>]*>', text)
    assert len(regions) == text.count('<div class="table"')
    names = [re.search(r'aria-label="([^"]+)"', region)[1] for region in regions]
    assert len(names) == len(set(names))


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind != "moving"])
def test_tidy_finds_no_error(every, kind):
    # a script fills what is empty on its page
    options = ("--drop-empty-elements", "no") if kind == "explore" else ()
    tidy_finds_nothing(every[kind], *options)


def test_what_scrolls_is_reached_by_keyboard(every, tmp_path):
    """On a phone, whatever is wider than its frame takes the focus."""
    wide = asked(
        every["stack"], tmp_path, 390,
        "[...document.querySelectorAll('body *')].filter(e =>"
        " e.scrollWidth > e.clientWidth + 1 && e.clientWidth > 0"
        " && ['auto', 'scroll'].includes(getComputedStyle(e).overflowX))"
        ".map(e => e.tabIndex)",
    )  # fmt: skip
    assert wide and set(wide) == {0}


def test_axe_sees_what_is_wrong(tmp_path):
    wrong = tmp_path / "wrong.html"
    wrong.write_text(
        '<!DOCTYPE html><html lang="en"><title>x</title><body><h1>a</h1><h3>b</h3>'
        '<p style="color: #ccc">words</p><table><tr><th></th><th>c</th></tr>'
        "<tr><td>1</td><td>2</td></tr></table></body></html>"
    )
    assert {rule for rule, *_ in violations(wrong, tmp_path)} >= {
        "color-contrast", "heading-order", "landmark-one-main",
    }  # fmt: skip
