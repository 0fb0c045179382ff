"""The first page: what decides comes first, for one limit and for thirty."""

from __future__ import annotations

import io
import tomllib
from dataclasses import replace

import numpy as np
import openpyxl
import pytest

import tolstat
from tests.answers.browser import asked
from tests.answers.conftest import chain
from tests.answers.page_checks import (
    PAPER,
    TALL,
    blocks_of,
    rows_of,
    section_of,
    tables_of,
    tiles_of,
    words_in,
    words_of,
)
from tests.conftest import ROOT
from tolstat import Contributor, Description, Model, Outcome, Response
from tolstat.answers.report import response_section
from tolstat.answers.report.chain_figures import chain_of, waterfall
from tolstat.answers.report.first_page import first_page, lead
from tolstat.answers.report.full_report import report_of
from tolstat.document.blocks import (
    Gallery,
    Paragraph,
    Ranges,
    Section,
    Table,
    figures_in,
)
from tolstat.document.inline import Typed
from tolstat.errors import QuestionError
from tolstat.render.page import page
from tolstat.render.screen import as_text
from tolstat.store.run_records import Stopped

MANY = 30


class Bolts(Model):
    """Clearances, each the sum of two parts; the last ones vary most."""

    name = "bolts"

    def describe(self, settings):
        parts = tuple(Contributor(f"flange_{i}", "m", f"l{i}") for i in (1, 2))
        every = (
            Response(f"clearance_{i}", "m", f"g{i}", f"clearance at bolt {i}")
            for i in range(1, MANY + 1)
        )
        return Description(parts, tuple(every))

    def evaluate(self, deviations, settings):
        size = np.arange(1, MANY + 1) / MANY
        return Outcome(deviations.sum(axis=1)[:, None] * size)


def bolts(tmp_path, limits, trials=2000):
    study = tmp_path / "bolts.toml"
    said = "".join(f"{name} = '{words}'\n" for name, words in limits.items())
    study.write_text(
        f"model = 'bolts'\ntrials = {trials}\nseed = 3\n[deviations]\n"
        f"flange = '+-0.1 mm'\n[limits]\n{said}"
    )
    return tolstat.run(study, model=Bolts(), force=True)


def drawn_in(section):
    """The picture of fractions out of limit in a section; None without one."""
    ranges = (each for each in blocks_of(section) if isinstance(each, Ranges))
    return next(ranges, None)


@pytest.fixture(scope="module")
def thirty(tmp_path_factory):
    limits = {f"clearance_{i}": "-0.1..0.1 mm" for i in range(1, MANY + 1)}
    return report_of(bolts(tmp_path_factory.mktemp("bolts"), limits))


def test_of_thirty_limits_the_worst_stand_on_the_first_page(thirty, tmp_path):
    document = thirty.document()
    worst, *_ = (each for each in tables_of(document) if each.title == "Limits")
    order = list(thirty.limits)
    assert [as_text(row["response"].main) for row in rows_of(worst)] == order[:6]
    assert as_text(worst.caption).startswith("The 6 worst of 30 limits; behind: All")
    (every,) = tables_of(section_of(document, "All limits"))
    assert [as_text(row["response"].main) for row in rows_of(every)] == order
    picture = drawn_in(section_of(document, "All limits"))
    assert [each.name for each in picture.rows] == order
    path = tmp_path / "thirty.html"  # with the figures of two responses, of thirty
    path.write_text(page(report_of(thirty.stored_run, order[:2]).document()))
    assert path.read_text().count("clearance_") > 2 * MANY
    wide = "document.documentElement.scrollWidth"
    assert asked(path, tmp_path, int(PAPER) + 1, wide, paper=True) <= PAPER + 1
    assert asked(path, tmp_path, 390, wide) <= 390


def test_the_screen_has_all_limits(thirty):
    (table,) = (
        each
        for each in tolstat.summary(thirty.stored_run).document().blocks
        if isinstance(each, Table) and each.title == "Limits"
    )
    assert len(table.rows) == MANY


def test_figures_are_of_the_worst_responses(thirty, monkeypatch):
    """Of many limits; figures take longer than all else of a page."""
    drawn, draw = [], response_section.figures_of

    def counting(report, name):
        drawn.append(name)
        return draw(report, name)

    monkeypatch.setattr(response_section, "figures_of", counting)
    document = thirty.document()
    assert drawn == list(thirty.limits)[:12] == list(thirty.illustrated)
    best = [*thirty.limits][-1]
    words = words_in(section_of(document, best))
    typed = f"tolstat report {thirty.stored_run.path} --response {best}"
    typed += " --machine FILE.py:NAME"  # the model was handed over
    assert f"drawn for the 12 worst responses. To draw these: {typed}." in words
    chosen = report_of(thirty.stored_run, list(thirty.limits)[-13:])
    drawn.clear()
    chosen.document()
    assert len(drawn) == 13


def test_of_sixty_contributors_a_page_has_the_first(tmp_path):
    """And says where all are: workbooks have them."""
    names = [f"plate_{i}" for i in range(60)]
    links = {name: {"nominal": "3 mm", "tolerance": "+-0.1 mm"} for name in names}
    study = chain("179.5..180.5 mm", links=links, trials=300)
    study["settings"] = {"gap": " + ".join(names)}
    report = report_of(tolstat.run(study, output=tmp_path / "a.h5"))
    section = section_of(report.document(), "Variance contributions")
    (table,) = tables_of(section)
    assert len(table.rows) == 40
    assert as_text(table.rows[0][0].below).endswith("plate_11 and 48 more")
    whole = section_of(report.document(whole=True), "Variance contributions")
    (all_rows,) = tables_of(whole)
    assert len(all_rows.rows) == 1 + 60  # the kind of part, and each
    assert "The first 40" not in words_in(whole)
    book = openpyxl.load_workbook(io.BytesIO(report.workbook()))
    assert 1 + 1 + 60 in [sheet.max_row for sheet in book]
    typed = f"tolstat report {tmp_path}/a.h5 --response gap -o {tmp_path}/a.gap.xlsx"
    assert f"The first 40 of 61. All: {typed}." in words_in(section)
    html = page(report.document())
    cells = html[html.index(">Variance contributions</h") :]
    assert cells[: cells.index("</table>")].count("<tr>") == 41


def test_a_single_limit_is_drawn(tmp_path):
    found = report_of(tolstat.run(chain("<= 2416.9 mm"), output=tmp_path / "a.h5"))
    (row,) = drawn_in(found.document()).rows
    assert row.level == pytest.approx(0.0027)
    assert row.found == found.limits["gap"].yields.fraction_out_of_limit
    assert row.tone == found.limits["gap"].yields.verdict
    free = {name: replace(each, limited=None) for name, each in found.responses.items()}
    free = replace(found, responses=free, all_limits=None)
    assert drawn_in(free.document()) is None


def test_responses_in_focus_follow_what_decides(tmp_path):
    """Without a trial out of limit the one next to its limit comes first."""
    limits = {
        "clearance_1": "<= 9 mm", "clearance_2": "<= 0.04 mm",
        "clearance_30": "<= 0.23 mm", "clearance_29": "<= 0.05 mm",
    }  # fmt: skip
    found = report_of(bolts(tmp_path, limits, 4000))
    assert found.verdicts.pop("clearance_29") == "not met"
    out = [each.yields.fraction_out_of_limit.value for each in found.limits.values()]
    assert out[0] > 0 and out[1:] == [0, 0, 0]
    order = ["clearance_29", "clearance_30", "clearance_2", "clearance_1"]
    assert list(found.focus) == list(found.limits) == order
    chosen = report_of(found.stored_run, ["clearance_2", "clearance_29"])
    assert chosen.focus == ("clearance_2", "clearance_29")


def test_a_spread_that_is_nothing_beside_the_limit_is_not_analysed(tmp_path):
    limits = {"clearance_1": "<= 90 mm", "clearance_30": "<= 0.23 mm"}
    found = report_of(bolts(tmp_path, limits))
    still, moves = (section_of(found.document(), name) for name in limits)
    assert "its spread is not analysed" in words_in(still)
    assert not any(isinstance(each, Gallery) for each in still.blocks)
    assert found.responses["clearance_1"].contributions is None
    parts = [each.title for each in still.blocks if isinstance(each, Section)]
    assert "Performance" in parts and "Variance contributions" not in parts
    assert "not analysed" not in words_in(moves)
    assert found.responses["clearance_30"].contributions is not None
    for limit in ("<= 0 mm", ">= 9 mm"):  # trials out of limit are always analysed
        other = report_of(bolts(tmp_path, {"clearance_1": limit}))
        assert not other.responses["clearance_1"].still


def test_a_run_in_part_says_so_first(tmp_path):
    run = bolts(tmp_path, {"clearance_30": "<= 0.1 mm"})
    status = np.where(np.arange(run.trials) < 700, run.status, 0).astype(np.uint8)
    part = replace(run, columns={**run.columns, "status": status}, complete=False)
    lead, whole = (
        next(b for b in first_page(report_of(each)) if isinstance(b, Paragraph))
        for each in (part, run)
    )
    assert as_text(lead.parts).endswith("So far 700 of 2000 trials have run.")
    assert "So far" not in as_text(whole.parts)


def test_settings_of_the_study_alone_are_listed(small_run):
    words = words_in(*tolstat.report(small_run).document().blocks)
    assert "Settings of the study: crank_speed 7.5 rad/s" in words
    assert "All others have their default: tolstat show stand." in words
    assert "(default)" not in words


def test_each_step_has_a_command(thirty):
    (steps,) = (
        each
        for each in first_page(thirty)
        if isinstance(each, Section) and each.title == "What to do next"
    )
    items = steps.blocks[0].items
    assert items and all(any(isinstance(p, Typed) for p in item) for item in items)


def test_that_every_limit_is_missed_is_said_so(tmp_path):
    """Where all are not met, one might be: "none" is said."""
    missed = {f"clearance_{i}": "<= -1 mm" for i in (1, 2)}
    assert "None of 2 limits is met." in first_words(bolts(tmp_path, missed, 200))
    one = missed | {"clearance_2": "<= 1 mm"}
    assert "1 of 2 limits is not met, 1 undecided." in first_words(
        bolts(tmp_path, one, 200)
    )


def first_words(run):
    return as_text(lead(report_of(run)).parts)


def test_a_way_to_judge_keeps_its_colour_and_numbers_without_the_first(stack):
    chain = chain_of(report_of(stack), "gap")
    three, two = map(waterfall, (chain, chain._replace(ranges=chain.ranges[1:])))
    colours, fewer = (f.picture.panels[0].layers[0].colours for f in (three, two))
    assert fewer[-2:] == colours[-2:] and len(set(colours[-3:])) == 3
    assert two.alt.split(", ")[1:] == [*three.alt.split(", ")[2:]]


def test_a_chain_is_drawn_and_fits_one_sheet(stack, tmp_path):
    """Tiles, histogram, links, waterfall, Pareto and three ways stand on page 1."""
    found = report_of(stack)
    document = found.document()
    descriptions = [each.alt.split(":")[0] for each in figures_in(document.blocks[0])]
    assert [words.split(" of ")[0] for words in descriptions] == [
        "Histogram", "Chain", "Waterfall", "Contributions, the largest first",
    ]  # fmt: skip
    behind = [each.alt.split(":")[0] for each in figures_in(*document.blocks[1:])]
    assert "Contributions, the largest first" not in behind and len(behind) == 3
    tiles = tiles_of(document)
    assert words_of(tiles["yield, this limit, %"]).split()[0] == "99.50"
    drawn = [*figures_in(document.blocks[0])][2].picture
    ends = drawn.panels[0].layers[0].values
    gap = found.responses["gap"]
    assert ends[0] == pytest.approx(1e3 * gap.nominal)
    assert ends[4] == pytest.approx(1e3 * gap.root_sum_square.mean)
    upper = 0.4430 + 3 * 0.06371, 1e3 * gap.quantiles[0.99865].value
    assert ends[5:] == pytest.approx([0.706, *upper], abs=2e-4)
    path = tmp_path / "stack.html"
    path.write_text(page(document))
    bottom = "document.querySelector('.first').getBoundingClientRect().bottom"
    assert asked(path, tmp_path, int(PAPER) + 1, bottom, paper=True) < TALL
    with pytest.raises(QuestionError, match="figure 'Waterfal of x'"):
        found.plot("Waterfal of x")


def test_cases_and_measured_parts_are_drawn_on_the_first_page(tmp_path):
    study = tomllib.loads((ROOT / "runs" / "cases.toml").read_text())
    study |= {"trials": 300, "cases": {"dT": ["-60 K", "0 K", "100 K"]}}
    first = report_of(tolstat.run(study)).document().blocks[0]
    assert [figure.alt for figure in figures_in(first)][1] == "gap by case"
    study = ROOT / "runs" / "measured-parts.toml"
    parts = tolstat.run(study, trials=300, output=tmp_path / "parts.h5")
    document = report_of(parts).document()
    first = replace(document, blocks=document.blocks[:1])
    cells = [c for t in tables_of(first) for row in t.rows for c in row if c.sketch]
    (sketch,) = (cell.sketch for cell in cells)
    assert sketch.ends == pytest.approx((-0.04e-3, 0.04e-3))


def test_links_of_a_long_chain_are_summed(tmp_path):
    """Of more than eight links the narrowest are one row; ends stay."""
    chain = tolstat.Chain(trials=200)
    for i in range(1, 13):
        chain = chain.link(f"p{i}", f"{10 * i} +{i}/-0 mm")
    gap = " + ".join(f"p{i}" for i in range(1, 13))
    run = chain.link("pin", "3 mm").gap("gap", f"{gap} - pin").limit("gap", ">= 780 mm")
    found = run.run().report()
    drawn = chain_of(found, "gap")
    assert [link.name for link in drawn.links][-1] == "5 others"
    ends = found.responses["gap"].nominal + sum(link.mean for link in drawn.links)
    assert ends == pytest.approx(found.responses["gap"].root_sum_square.mean)
    assert drawn.fixed == pytest.approx(-0.003, abs=1e-9)
    assert sum(link.upper for link in drawn.links) == pytest.approx(0.078)


def test_where_units_fail_is_drawn(report):
    """The trials out of limit, in red, over the two rods that cause them."""
    figure = report.answer.plot("Trials of jam_share out of limit")
    within, out, box = figure.axes[0].lines
    causes = report.answer.responses["jam_share"].causes
    assert len(out.get_xdata()) == causes.trials_out_of_limit
    assert len(within.get_xdata()) == 1500
    assert sorted({*box.get_xdata()}) == pytest.approx([-1.2, 1.2])


def test_an_interval_narrows_with_trials(stack):
    stopped = Stopped(("decide",), True, (6000, 10000), 20000)
    found = report_of(replace(stack, stopped=stopped))
    (curve,) = found.plot("Fraction of gap out of limit").axes[0].lines[:1]
    trials, shares = curve.get_data()
    assert trials.tolist() == [156, 312, 625, 1250, 2500, 5000, 6000, 10000]
    values, limit = stack.column("gap"), stack.limits["gap"]
    for n, ppm in zip(trials.astype(int), shares, strict=True):
        good = (values[:n] >= limit.lower) & (values[:n] <= limit.upper)
        assert ppm == pytest.approx(1e6 * (1 - good.mean()))


@pytest.fixture(scope="module")
def stack(tmp_path_factory):
    path = tmp_path_factory.mktemp("stack") / "stack-up.h5"
    return tolstat.run(ROOT / "runs" / "stack-up.toml", output=path)


def test_corners_that_fail_are_said_beside_the_worst_one(tmp_path):
    """Both parts long cannot be mounted: no trial shows it, a corner does."""

    class Jams(Bolts):
        name = "jams"

        def describe(self, settings):
            parts = tuple(Contributor(f"flange_{i}", "m") for i in (1, 2))
            return Description(parts, (Response("gap", "m", shown="mm"),))

        def evaluate(self, deviations, settings):
            gap = deviations.sum(axis=1)
            return Outcome(np.where(gap > 1.9e-3, np.nan, gap)[:, None])

    study = {
        "model": "jams", "trials": 300, "seed": 1,
        "deviations": {f"flange_{i}": "+-1 mm" for i in (1, 2)},
        "limits": {"gap": "<= 1.95 mm"},
    }  # fmt: skip
    run = tolstat.run(study, model=Jams(), output=tmp_path / "jams.h5")
    case = run.worst_cases("gap")["largest"]
    assert case.failed and case.value < 1.95e-3
    words = words_in(*tolstat.summary(run).document().blocks)
    assert f" mm and {case.failed} corner" in words
    assert "that failed (<= 1.95 mm)" in words
