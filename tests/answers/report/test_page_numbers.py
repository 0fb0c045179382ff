"""Every number of a report: source, column, digits."""

from __future__ import annotations

import math

import numpy as np
import pytest

import tolstat
from tests.answers.conftest import chain
from tests.answers.page_checks import (
    a_ppk_without_interval_stands_as_small_as_its_reason,
    every_number_is_one_of_the_answer,
    last_place,
    number_in,
    rows_of,
    says,
    section_of,
    table_under,
    tables_of,
    tiles_of,
    words_in,
    words_under,
)
from tolstat.answers.cells import ppk_cell
from tolstat.answers.report.full_report import report_of
from tolstat.answers.report.response_figures import bars_of
from tolstat.answers.report.response_section import response_section
from tolstat.document.blocks import Cell
from tolstat.document.inline import Number, in_cell, plain
from tolstat.document.plot import Histogram, Mark
from tolstat.render.page import _cell
from tolstat.render.screen import as_text
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.limits.yields import MET
from tolstat.statistics.sensitivity.contributions import contributions
from tolstat.statistics.summary import QUANTILES
from tolstat.units.scale import Ratio, share_words


def test_every_printed_number_is_in_the_answer(report):
    every_number_is_one_of_the_answer(report)


def test_a_ppk_without_interval_is_as_small_as_its_reason(report):
    for name in report.answer.focus:
        limited = report.answer.responses[name].limited
        table = table_under(section_of(report.document, name), "Performance")
        assert number_in(rows_of(table)[0]["Ppk"]) == limited.equivalent_ppk
        by = (limited.percentiles, limited.moments)
        a_ppk_without_interval_stands_as_small_as_its_reason(
            table.rows[1:], report.text, [(each.pp, each.ppk) for each in by]
        )


def test_a_ppk_without_interval_is_below_with_its_reason():
    cell = ppk_cell(Estimate(1.2, reason="few trials dominate"))
    assert not cell.main and as_text(cell.below) == "1.2: few trials dominate"
    assert ppk_cell(Estimate(1.2, 1.0, 1.4)).main


def test_numbers_have_the_digits_that_their_intervals_support(report, mill):
    """Two figures of half the interval, ten at most; without an interval four, or as
    many as tell a thousandth of what the trials spread over, or of what is limited.
    """
    checked = {"four": 0, "interval": 0, "nothing": 0}
    on_page = {*report.page.numbers}
    for row in rows_of(table_under(report.document, "Responses")):
        name = as_text(row["response"].main)
        factor = mill.scales[name].factor
        heads = [head for head in row if head not in ("response", "unit")]
        for head in heads:
            (number,) = row[head].main
            main, below = in_cell(number)
            size = np.abs(mill.column(name)).max()
            digits = [x for x in (*main, *below) if not isinstance(x, str)]
            for words, value in digits:
                assert (repr(value), words) in on_page
                assert says(words, factor * value), (name, head, words, factor * value)
                if words.startswith(("below", "above")):
                    assert abs(value) < 1e-5 * size
                    checked["nothing"] += 1
            if not main or main[0].text.startswith(("below", "above")):
                continue
            ((words, value),) = main
            if head in ("nominal", "least", "largest"):
                figures = words.lstrip("-0.").partition("e")[0].replace(".", "")
                exact = abs(float(words) - factor * value) <= 1e-9 * abs(factor * value)
                four = len(figures) == (3 if "e" in words else 4)
                last = last_place(words) / factor
                spread = 1e-3 * np.ptp(mill.column(name))
                told = last / 2 <= spread and len(figures) > 4
                told |= name in mill.limits and len(figures) > 4
                assert four or exact or told, (name, head, words)
                checked["four"] += 1
            elif len(below) == 3:  # lower, "to", upper
                lower, upper = below[0].value, below[2].value
                half = factor * (upper - lower) / 2
                if half == 0 or words == "0" or value in (lower, upper):
                    continue  # of a bound: see the tests of scales
                size = factor * max(abs(value), abs(lower), abs(upper))
                supported = 10.0 ** (math.floor(math.log10(half)) - 1)
                allowed = 10.0 ** (math.floor(math.log10(size)) - 9)
                own = 10.0 ** (math.floor(math.log10(abs(factor * value))) - 2)
                least = min(max(supported, allowed), own)  # three figures at least
                assert last_place(words) >= 0.99 * least, (name, head)
                if "." in words:
                    assert last_place(words) <= 1.01 * least, (name, head)
                checked["interval"] += 1
    assert min(checked.values()) > 15, checked


SHARES = ["0.135 %", "5 %", "50 %", "95 %", "99 %", "99.865 %"]


def test_summary_numbers_are_in_their_columns(report, mill):
    table = table_under(report.document, "Responses")
    assert [each.head for each in table.columns] == [
        "response", "unit", "nominal", "mean *", "sigma *", "least", *SHARES, "largest",
    ]  # fmt: skip
    rows = rows_of(table)
    every = report.answer.responses
    free = [name for name in every if name not in mill.limits]
    zero = [n for n in free if not mill.column(n).any() and not mill.nominal_values[n]]
    shown = {name: each for name, each in every.items() if name not in zero}
    assert len(every) == 30 and len(zero) == 6
    assert f"Zero in every trial: {', '.join(zero[:-1])}" in as_text(table.caption)
    for (name, each), row in zip(shown.items(), rows, strict=True):
        assert as_text(row["response"].main) == name
        known = {"nominal": each.nominal, "mean *": each.mean, "sigma *": each.sigma}
        known |= {"least": each.least, "largest": each.largest}
        known |= {
            head: each.quantiles[q]
            for q in QUANTILES
            if (head := share_words(q)) in SHARES
        }
        for head, value in known.items():
            assert row[head].main == (Number(value, mill.scales[name]),), (name, head)


def test_limit_numbers_are_in_their_columns(report):
    table = table_under(report.document, "Limits")
    assert [each.head for each in table.columns] == [
        "response", "limit", "verdict", "out of limit, ppm", "equivalent Ppk",
        "main cause", "what would help",
    ]  # fmt: skip
    for name, row in zip(report.answer.limits, rows_of(table), strict=True):
        each = report.answer.responses[name]
        limited, needed = each.limited, each.limited.yields.needed
        assert as_text(row["response"].main) == name
        assert as_text(row["limit"].main) == limited.limit.words
        assert as_text(row["limit"].below) == "for 99.73 %"
        assert as_text(row["verdict"].main) == limited.yields.verdict
        told = f"about {needed} trials decide" if needed else ""
        assert as_text(row["verdict"].below) == told
        assert (
            number_in(row["out of limit, ppm"]) == limited.yields.fraction_out_of_limit
        )
        assert number_in(row["equivalent Ppk"]) == limited.equivalent_ppk
        assert as_text(row["equivalent Ppk"].below) == "demanded 0.9274"
        helps = row["what would help"].below
        remedy = report.answer.findings.remedy
        if remedy and remedy.steps and limited.yields.verdict != MET:
            assert helps[0].value == remedy.limits[name][1]
        else:
            assert not helps


def test_shares_are_printed_in_per_cent_and_ppm(report):
    out = report.answer.responses["jam_share"].limited.yields.fraction_out_of_limit
    assert out.value > 1e-3
    row = next(
        row
        for row in rows_of(table_under(report.document, "Limits"))
        if as_text(row["response"].main) == "jam_share"
    )
    shown = plain(in_cell(row["out of limit, ppm"].main[0])[0])
    assert says(shown, 1e6 * out.value)
    grouped = f"{int(shown):,}".replace(",", "\u202f")
    assert (repr(out.value), grouped) in report.page.numbers
    within = report.answer.all_limits.within.value
    (shown,) = {words for value, words in report.page.numbers if value == repr(within)}
    assert says(shown, 100 * within)


def test_slopes_and_the_worst_corner_have_units(report, mill):
    section = section_of(report.document, "rod_force_1")
    rows = {
        as_text(row["contributor"].main): row
        for table in tables_of(section_of(section, "Variance contributions"))
        if "slope at the nominal trial" in [each.head for each in table.columns]
        for row in rows_of(table)
    }
    slopes = mill.diagnostics.slopes["rod_force_1"]
    corner = mill.diagnostics.worst_cases["rod_force_1"]["largest"].deviations
    for name, unit, factor in (
        ("rod_length_1", "kN/mm", 1e-6), ("crank_angle_1", "kN/deg", np.pi / 180e3),
    ):  # fmt: skip
        slope, *_ = shown = rows[name]["slope at the nominal trial"].main
        assert slope.value == slopes[name] and isinstance(slope.scale, Ratio)
        words = as_text(shown)
        assert f"{words.split()[0]}</span> {unit}<" in _cell(Cell(shown))
        assert words.endswith(f" {unit}")
        assert says(words.split()[0], factor * slopes[name])
        worst = as_text(rows[name]["worst case, largest"].main)
        assert worst.endswith(f" {mill.scales[name].mark}")
        assert says(worst.split()[0], mill.scales[name].factor * corner[name])


def test_a_histogram_shows_limit_and_mean(report):
    figures = dict(report.figures)
    for name in report.answer.focus:
        each = report.answer.responses[name]
        words = next(w for w in figures if w.startswith(f"Histogram of {name}:"))
        layers = figures[words].panels[0].layers
        labels = [layer.words for layer in layers if isinstance(layer, Mark)]
        factor = 10.0 ** {"kN": -3, "kN m": -3, "%": 2}[each.scale.shown]
        (upper,) = (label for label in labels if label.startswith("USL "))
        assert says(upper.split()[1], factor * each.limited.limit.upper)
        assert not any(label.startswith("LSL") for label in labels)
        mean = next(label for label in labels if label.startswith("mean"))
        assert says(mean.split()[1], factor * each.mean.value)


def test_bars_out_of_limit_are_coloured(report):
    words = next(w for w, _ in report.figures if "Histogram of jam_share" in w)
    layers = dict(report.figures)[words].panels[0].layers
    within, out = (layer for layer in layers if isinstance(layer, Histogram))
    for bars, sign in ((within, -1), (out, 1)):
        drawn = bars.edges[:-1][bars.heights > 0]
        assert (sign * (drawn - 50.0) >= -1e-9).all()  # %
        assert (bars.colour == "limit") == (sign > 0)
    share = report.answer.responses[
        "jam_share"
    ].limited.yields.fraction_out_of_limit.value
    counted = out.heights.sum()
    assert counted == pytest.approx(share * 2200, rel=0.05)


def test_the_caption_of_a_histogram_counts_its_trials(report, mill):
    captions = words_under(report.text, "figcaption")
    masses = [report.answer.responses[name].point_mass for name in report.answer.focus]
    assert any(masses)
    for name, mass in zip(report.answer.focus, masses, strict=True):
        rest = mill.column(name)
        if mass:
            rest = rest[(rest < mass.least) | (rest > mass.largest)]
        words = f"{name}: {len(rest)} trials"
        words += ", without those that share one value." if mass else "."
        assert any(words in each for each in captions), words


def test_one_failed_trial_is_visible_in_every_table(tmp_path, toy, toy_study):
    class Once(type(toy)):
        def evaluate(self, deviations, settings):
            outcome = super().evaluate(deviations, settings)
            worst = np.abs(deviations[:, 0] - WORST) < 1e-15
            return outcome._replace(status=np.where(worst, 4, 1))

    WORST = math.nan
    toy_study.write_text(toy_study.read_text().replace("1000", "384"))
    WORST = tolstat.run(toy_study, model=Once()).column("part_1")[100]
    run = tolstat.run(toy_study, model=Once(), force=True)
    assert run.counts["not finite"] == 1
    found = report_of(run)
    numbers = [
        each
        for each in tables_of(found.document())
        if "distribution" not in [column.head for column in each.columns]
    ]
    assert len(numbers) >= 4
    for table in numbers:
        assert "383 trials done, 1 failed" in as_text(table.caption)
    assert "yield, if failed trials were good" in found.html()


def test_captions_of_groups_count_the_trials_used(toy, toy_study):
    """Of a run for Sobol' indices: two trials of each group, and whole groups."""
    toy_study.write_text(f'sampling = "saltelli"\n{toy_study.read_text()}')
    run = tolstat.run(toy_study, model=toy, trials=4000)
    document = report_of(run).document()
    status = run.status.reshape(-1, 5)
    done = np.count_nonzero(status[:, :2] == 1)
    every, whole = run.counts["done"], np.count_nonzero(np.all(status == 1, axis=1))
    assert done < 1600 and every < 4000 and whole < 800
    captions = [as_text(each.caption) for each in tables_of(document)]
    counts = f"{done} trials done, {1600 - done} failed, of the 1600 that statistics"
    worst = f"of all {every} trials done"
    assert worst in captions
    assert all(counts in each or each in (worst, "") for each in captions)
    without = [each for each in tables_of(document) if not each.caption]
    assert {each.columns[0].head for each in without} == {"contributor"}  # tolerances
    words = words_in(*document.blocks)
    assert f"{4000 - every} of 4000 trials failed" in words
    assert f"{1600 - done} of the 1600 that statistics rest on" in words
    assert f"Fraction below, of {done} trials done" in words
    assert f"of {whole} groups of trials ({800 - whole} left out" in words
    assert f"Each of the {done} trials done" in words


def test_main_causes_come_from_the_stored_columns(report, mill):
    found = report.json["responses"]["jam_share"]["causes"]
    out = mill.column("jam_share") > 0.5
    assert found["trials_out_of_limit"] == out.sum() > 10 and found["reason"] == ""
    rod = mill.column("rod_length_1")
    said = found["contributors"]["rod_length_1"]
    off = (rod[out] - rod.mean()) / rod.std()
    assert said["shift"] == pytest.approx(off.mean())
    assert said["width"] == pytest.approx(np.sqrt(np.mean(off**2)))
    assert said["width"] > 1.5 and said["level"] < 1e-6
    assert found["contributors"]["crank_angle_1"]["level"] > 0.05
    rods = found["kinds"]["rods"]
    assert rods["level"] < 1e-6 and rods["halved"]["upper"] < 0.01
    stored = mill.diagnostics.halved["jam_share"]["rod_length_1", "rod_length_2"]
    assert rods["halved"]["value"] == stored.beyond.value
    assert rods["effective_sample_size"] == stored.effective
    phase = found["contributors"]["runout_phase_7"]["halved"]
    assert phase["value"] is None and phase["reason"] == "a full turn is no tolerance"
    section = response_section(report.answer, "jam_share")
    table = table_under(section, "Main causes of out-of-limit trials")
    strong = {
        part.text
        for row in table.rows
        for part in row[0].main
        if getattr(part, "tone", "") == "strong"
    }
    assert "rods" in strong and "cranks" not in strong


@pytest.mark.parametrize(
    ("demand", "share", "ppk"),
    [
        ({"ppk": 1.33}, "for Ppk 1.33", "demanded 1.33"),
        ({"ppk": 2}, "for Ppk 2", "demanded 2"),
        ({"ppm": 2000}, "for 2000 ppm", "demanded 0.9594"),
        ({"ppm": 10}, "for 10 ppm", "demanded 1.422"),
        ({"ppm": 1e-6}, "for 1e-6 ppm", "demanded 2.345"),
        ({"yield": "99.8 %"}, "for 99.8 %", "demanded 0.9594"),
        ({}, "for 99.73 %", "demanded 0.9274"),
    ],
)
def test_a_demanded_value_is_printed_exactly(demand, share, ppk, tmp_path):
    """As it is typed, or of four figures to the nearest: it is no bound."""
    study = chain({"limit": "<= 2416.9 mm", **demand}, trials=100)
    run = tolstat.run(study, output=tmp_path / "run.h5")
    (row,) = rows_of(table_under(tolstat.summary(run).document(), "Limits"))
    assert as_text(row["limit"].below) == share
    assert as_text(row["equivalent Ppk"].below) == ppk
    tiles = tiles_of(tolstat.report(run).document())
    assert next(iter(tiles)).endswith(share)
    assert as_text(tiles["equivalent Ppk"].below) == ppk


def test_shares_of_very_many_trials_are_those_of_the_first(tmp_path, monkeypatch):
    run = tolstat.run(chain("2416.4..2416.9 mm"), output=tmp_path / "a.h5")
    first = tolstat.run(
        chain("2416.4..2416.9 mm"), trials=600, output=tmp_path / "b.h5"
    )
    expected = report_of(first).responses["gap"].contributions.first_order
    monkeypatch.setattr(f"{contributions.__module__}.MOST_TRIALS", 600)
    monkeypatch.setattr(f"{response_section.__module__}.MOST_TRIALS", 600)
    report = report_of(run)
    assert report.responses["gap"].contributions.first_order == expected
    section = section_of(report.document(), "Variance contributions")
    assert "Shares are those of the first 600 trials." in words_in(section)


@pytest.mark.parametrize(
    ("permitted", "colour"),
    [((19.98, 20.02), "first"), ((-np.inf, 20.0), "first"), ((20.1, 20.2), "limit")],
)
def test_equal_values_are_one_bar_in_its_middle(permitted, colour):
    """Narrow beside what is permitted, as high as there are values."""
    drawn = bars_of(np.full(60, 20.0), permitted, 1.0)
    (bars,) = (each for each in drawn if each.heights.any())
    (row,) = np.flatnonzero(bars.heights)
    middle, wide = bars.edges[row : row + 2].mean(), np.diff(bars.edges)[row]
    assert (bars.colour, bars.heights[row]) == (colour, pytest.approx(60))
    assert middle == pytest.approx(20.0) and wide < 0.7
