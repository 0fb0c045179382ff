"""The page in a browser: what a user types and drags, narrow screens, no request."""

import shutil

import pytest

import tolstat
from tests.answers.browser import asked, scroll_widths
from tests.answers.explore.node import readings
from tests.conftest import ROOT

MM = 1e-3


@pytest.fixture(scope="module")
def explored(tmp_path_factory):
    study = ROOT / "runs" / "stack-up.toml"
    folder = tmp_path_factory.mktemp("page")
    return tolstat.explore(tolstat.run(shutil.copy(study, folder)))


@pytest.fixture(scope="module")
def page(explored, tmp_path_factory):
    return explored.save(tmp_path_factory.mktemp("page") / "page.html")


def typing(field, value):
    """Return what types a value into a field."""
    return (
        f"const input = document.getElementById('{field}'); input.value = {value};"
        " input.dispatchEvent(new Event('input', {bubbles: true}));"
    )


CARD = "document.querySelector('[data-card=\"1\"]').textContent"
AREAS = "['command', 'toml'].map(id => document.getElementById(id).value)"


def test_typing_changes_card_command_and_study(explored, page, tmp_path):
    change = {"entries": {"housing": {"half": 0.06 * MM}}}
    (reading,) = readings(explored, tmp_path, [change])
    question = f"(() => {{ {typing('e0-half', 0.06)} return [{CARD}, {AREAS}]; }})()"
    card, (command, toml) = asked(page, tmp_path, 1200, question)
    ppm = f"{1e6 * reading['responses']['gap']['share']:.0f} ppm out of limit"
    assert ppm in card
    assert "met" in card
    assert command == reading["command"]
    assert toml == reading["toml"]


@pytest.fixture(scope="module")
def gaps(tmp_path_factory):
    folder = tmp_path_factory.mktemp("gaps")
    path = folder / "gaps.h5"
    run = tolstat.run(ROOT / "runs" / "gaps.toml", trials=10_000, output=path)
    return run, tolstat.explore(run).save(folder / "gaps.html")


def test_a_card_names_the_limit_that_is_not_met(gaps, tmp_path):
    run, page = gaps
    entries = [
        entry.written.name for entry in tolstat.explore(run).data.entries.entries
    ]
    housing, ring = entries.index("housing"), entries.index("ring")
    typed = [(f"e{housing}-nominal", 120.29), (f"e{housing}-half", 0.05)]
    steps = [*typed, (f"e{ring}-nominal", 2.05)]
    moves = " ".join(f"{{ {typing(field, value)} }}" for field, value in steps)
    verdict = (
        "(() => { %s const card = document.querySelector('[data-card=\"1\"]');"
        " const mark = card.querySelector('.verdict'); return [mark.className,"
        " mark.parentElement.textContent.trim()]; })()"
    )
    kind, words = asked(page, tmp_path, 1200, verdict % moves)
    assert kind == "verdict not-met"
    assert words == "not met ring_play"
    normal = (
        "explorer.responses.map((r, i) => { focus = i; draw();"
        f" return [r.name, {CARD}.includes('by moments')]; }})"
    )
    shown = dict(asked(page, tmp_path, 1200, normal))
    assert not shown["play"]
    assert shown["ring_play"]


def test_each_limit_has_its_ppk_in_each_scenario(gaps, tmp_path):
    rows = (
        "[...document.querySelectorAll('[data-limits]')].map(row =>"
        " [...row.cells].map(cell => cell.textContent.trim()))"
    )
    table = {row[0]: row[1:] for row in asked(gaps[1], tmp_path, 1200, rows)}
    limits = tolstat.report(gaps[0]).limits
    assert {*table} == {*limits}
    for name, limited in limits.items():
        ppk = limited.equivalent_ppk
        drawing = table[name][0]
        assert drawing.startswith(limited.yields.verdict)
        assert f"({_plain(ppk.lower)} to {_plain(ppk.upper)})" in drawing


def _plain(x):
    return "infinite" if x == float("inf") else f"{x:#.3g}"


def test_a_slider_and_a_curve_move_as_typing_does(page, tmp_path):
    slide = f"(() => {{ {typing('e0-half-r', 0.06)} return {CARD}; }})()"
    typed = f"(() => {{ {typing('e0-half', 0.06)} return {CARD}; }})()"
    first, second = (asked(page, tmp_path, 1200, q) for q in (slide, typed))
    assert first == second
    drag = (
        "(() => { const svg = document.querySelector('#e0 svg[data-field=half]');"
        " const box = svg.getBoundingClientRect();"
        " svg.dispatchEvent(new PointerEvent('pointermove', {bubbles: true, buttons: 1,"
        " clientX: box.left, clientY: box.top}));"
        " return document.getElementById('e0-half').value; })()"
    )
    assert float(asked(page, tmp_path, 1200, drag)) == pytest.approx(0.012)


def test_the_drawing_is_not_moved(page, tmp_path):
    question = (
        "(() => { document.querySelector('[data-card=\"0\"]').click();"
        f" {typing('e0-half', 0.06)} return [document.querySelector('#controls')"
        ".disabled, document.getElementById('toml').value]; })()"
    )
    disabled, toml = asked(page, tmp_path, 1200, question)
    assert disabled
    assert toml == "# as on the drawing"


def test_the_address_is_read_again(page, tmp_path):
    question = (
        f"(() => {{ {typing('l-upper', 0.55)} while (queue.length) queue.shift()();"
        " const kept = explorer.restored(location.hash.slice(1));"
        " return [kept.chosen, kept.scenarios[0].limits[0].upper]; })()"
    )
    assert asked(page, tmp_path, 1200, question) == [1, pytest.approx(0.55 * MM)]


def test_it_fits_a_phone_and_asks_for_nothing(page, tmp_path):
    assert scroll_widths(page, tmp_path, [390, 1100]) == [390, 1100]
    assert asked(page, tmp_path, 390, "performance.getEntriesByType('resource')") == []


def test_each_control_has_a_name(page, tmp_path):
    question = (
        "[...document.querySelectorAll('input, select, textarea, button')].filter(x =>"
        " !(x.ariaLabel || x.labels?.[0]?.textContent.trim() || x.textContent.trim()))"
        ".map(x => x.id)"
    )
    assert asked(page, tmp_path, 1200, question) == []
    heads = "[...document.querySelectorAll('h1, h2, h3')].map(x => x.tagName)"
    assert asked(page, tmp_path, 1200, heads)[:2] == ["H1", "H2"]
