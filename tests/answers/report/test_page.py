"""The page: every number from the findings, safe, whole, and looked at by a browser."""

from __future__ import annotations

import math
import re
import shlex
import shutil
import subprocess
from dataclasses import replace
from html import unescape
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Text

import tolstat
from tests.conftest import Toy
from tests.reporting.browser import Page, asked, look, printed, scroll_widths
from tolstat.answers.compare import comparison_page
from tolstat.answers.compare.comparison import compared_with_first
from tolstat.answers.compare.comparison_page import make_comparison_page
from tolstat.answers.rare.rare_answer import STAGES, UNMET, rare_findings, rare_table
from tolstat.answers.report import distribution_pictures, response_pictures
from tolstat.answers.report.gather import findings_of
from tolstat.answers.report.summary_table import summary_table
from tolstat.answers.report.template_page import make_page, pictures_of
from tolstat.answers.report.template_page import page_of as page_of_findings
from tolstat.cli.main import main
from tolstat.model.contract import Outcome
from tolstat.render.page_picture import SMALLEST
from tolstat.render.plain import plain
from tolstat.store.stored_diagnostics import Diagnostics


def page_of(run):
    """Make the report of a run as the command does."""
    found = findings_of(run)
    return make_page(run, found, pictures_of(run, found)), plain(found)


class Made:
    """A page, its findings, and the figures that were drawn for it."""

    def __init__(self, text, found, figures, path):
        self.text, self.found, self.figures, self.path = text, found, figures, path
        path.write_text(text, encoding="utf-8")
        self.page = Page(text)


@pytest.fixture(scope="module")
def figures():
    """Keep what is drawn."""
    kept = []
    patch = pytest.MonkeyPatch()
    for module in (distribution_pictures, response_pictures, comparison_page):
        original = module.inline

        def keep(figure, alternative, original=original):
            kept.append((alternative, figure))
            return original(figure, alternative)

        patch.setattr(module, "inline", keep)
    yield kept
    patch.undo()


@pytest.fixture(scope="module")
def report(mill, figures, tmp_path_factory):
    figures.clear()
    text, found = page_of(mill)
    path = tmp_path_factory.mktemp("page") / "report.html"
    return Made(text, found, list(figures), path)


@pytest.fixture(scope="module")
def comparison(mill, linked, figures, tmp_path_factory):
    pairs, found = compared_with_first([mill, linked])
    figures.clear()
    text = make_comparison_page(pairs, found)
    path = tmp_path_factory.mktemp("page") / "comparison.html"
    return Made(text, plain(found.alone), list(figures), path)


@pytest.fixture(params=["report", "comparison"])
def made(request):
    return request.getfixturevalue(request.param)


def at(found, path):
    for key in path.split("/"):
        found = found[int(key)] if isinstance(found, list) else found[key]
    return found


def test_every_printed_number_is_one_of_the_findings(made):
    assert len(made.page.numbers) > 300
    for path, value, words in made.page.numbers:
        known = at(made.found, path)
        assert repr(known) == value, path
        assert words.strip(), path


@pytest.mark.parametrize(
    ("made", "of"), [("report", "moments/ppk"), ("comparison", "ppk_more_by_moments")],
    indirect=["made"],
)  # fmt: skip
def test_a_ppk_that_no_interval_holds_stands_as_small_as_its_reason(made, of):
    small = set()
    for path, _, words in made.page.numbers:
        if path.endswith(f"{of}/value"):
            ppk = at(made.found, path.removesuffix("/value"))
            before = made.text[: made.text.index(f'data-path="{path}"')]
            soft = re.search(r'<span class="range"><span [^<]*$', before) is not None
            assert soft == (ppk["lower"] is None), path
            assert not soft or f"{words}</span>: {ppk['reason']}" in made.text
            small.add(soft)
    assert True in small


def last_place(words):
    """Where the last figure of a printed number stands: 1.50e-4 ends at 1e-6."""
    digits, _, exponent = words.partition("e")
    decimals = len(digits.partition(".")[2])
    if not exponent and "." not in digits:  # whole: zeros may stand for nothing
        decimals = -(len(digits) - len(digits.rstrip("0")))
    return 10.0 ** (int(exponent or 0) - decimals)


def says(words, shown):
    """Whether printed words say a number."""
    if words.startswith(("below", "above")):
        return abs(shown) < abs(float(words.split()[1]))
    return abs(float(words) - shown) <= 0.501 * last_place(words) + 1e-12 * abs(shown)


def test_numbers_are_printed_to_the_digits_their_intervals_support(report, mill):
    """Two figures of half the interval, ten at most; without an interval four, or as
    many as tell a thousandth of what the machines spread over, or of what is asked.
    """
    checked = {"four": 0, "interval": 0, "nothing": 0}
    printed = {
        path: (float(value), words) for path, value, words in report.page.numbers
    }
    for path, (value, words) in printed.items():
        keys = path.split("/")
        if keys[0] != "responses" or keys[2] not in (
            "nominal", "mean", "sigma", "least", "largest", "quantiles",
        ):  # fmt: skip
            continue
        factor = mill.scales[keys[1]].factor
        assert says(words, factor * value), (path, words, factor * value)
        if words.startswith(("below", "above")):
            size = np.abs(mill.column(keys[1])).max()
            assert abs(value) < 1e-5 * size
            checked["nothing"] += 1
        elif keys[2] in ("nominal", "least", "largest"):
            figures = words.lstrip("-0.").partition("e")[0].replace(".", "")
            exact = abs(float(words) - factor * value) <= 1e-9 * abs(factor * value)
            four = len(figures) == (3 if "e" in words else 4)
            last = last_place(words) / factor
            spread = 1e-3 * np.ptp(mill.column(keys[1]))
            told = last / 2 <= spread and len(figures) > 4
            told |= keys[1] in mill.limits and len(figures) > 4
            assert four or exact or told, (path, words)
            checked["four"] += 1
        elif keys[-1] == "value" and path.replace("value", "lower") in printed:
            ends = [printed[path.replace("value", end)] for end in ("lower", "upper")]
            half = factor * (ends[1][0] - ends[0][0]) / 2
            if half == 0 or words == "0" or value in (ends[0][0], ends[1][0]):
                continue  # of a bound: see the tests of scales
            size = factor * max(abs(value), abs(ends[0][0]), abs(ends[1][0]))
            supported = 10.0 ** (math.floor(math.log10(half)) - 1)
            allowed = 10.0 ** (math.floor(math.log10(size)) - 9)
            assert last_place(words) >= 0.99 * max(supported, allowed), path
            if "." in words:
                assert last_place(words) <= 1.01 * max(supported, allowed), path
            checked["interval"] += 1
    assert min(checked.values()) > 15, checked


def rows_of(page, head):
    """Paths of the numbers of a table by its rows, ends of intervals left out."""
    table = page[page.index(head) :]
    table = table[: table.index("</table>")]
    return [
        [
            path
            for path in re.findall(r'data-path="([^"]+)"', row)
            if path.rpartition("/")[2] not in ("lower", "upper")
        ]
        for row in table.split("<tr>")[2:]
    ]


QUANTILES = ["0.135 %", "5 %", "50 %", "95 %", "99 %", "99.865 %"]


def test_each_number_of_the_summary_stands_under_its_head(report):
    heads = ["nominal", "mean/value", "sigma/value", "least"]
    heads += [f"quantiles/{share}/value" for share in QUANTILES] + ["largest"]
    table = report.text[report.text.index(">Summary</h2>") :]
    words = re.findall(r"<th[^>]*>([^<]*)</th>", table[: table.index("</thead>")])
    assert words == [
        "response", "nominal", "mean *", "sigma *", "least", *QUANTILES, "largest",
    ]  # fmt: skip
    rows = rows_of(report.text, ">Summary</h2>")
    assert len(rows) == 24
    for name, row in zip(report.found["responses"], rows, strict=True):
        each = report.found["responses"][name]["quantiles"]
        shown = [
            f"responses/{name}/{head}"
            for head in heads
            if not (head[:9] == "quantiles" and "needs" in each[head[10:-6]]["reason"])
        ]
        assert row == shown


def test_each_number_of_the_verdict_stands_under_its_head(report):
    rows = rows_of(report.text, "<h2>Verdict")
    for name, row in zip(report.found["interest"], rows, strict=True):
        path = f"responses/{name}/limited"
        needed = [f"{path}/yields/needed"] * (f"{path}/yields/needed" in row)
        assert row == [
            f"{path}/limit/demanded", *needed, f"{path}/yields/out_of_limit/value",
            f"{path}/equivalent/value", f"{path}/demanded_ppk",
        ]  # fmt: skip


def test_each_difference_stands_under_its_head(comparison):
    rows = rows_of(comparison.text, "<h2>Differences")
    heads = ["smaller/value", "larger/value", "difference/mean/value"]
    for name, row in zip(comparison.found["responses"], rows, strict=True):
        path = f"responses/{name}"
        assert row[:4] == [f"{path}/{h}" for h in [*heads, "difference/least"]]
        assert row[-1] == f"{path}/difference/largest"


def test_a_share_is_printed_per_cent_and_per_million(report):
    numbers = {path: words for path, _, words in report.page.numbers}
    limit = report.found["responses"]["jam_share"]["limited"]["yields"]["out_of_limit"]
    beyond = "responses/jam_share/limited/yields/out_of_limit/value"
    assert says(numbers[beyond], 1e6 * limit["value"]) and limit["value"] > 1e-3
    within = report.found["joint"]["within"]["value"]
    assert says(numbers["joint/within/value"], 100 * within)


def test_the_page_has_its_parts_in_order(report):
    heads = re.findall(r"<h2[^>]*>(.*?)</h2>", report.text)
    limited = list(report.found["interest"])
    assert limited[0] == "extra_loss" and len(limited) == 5
    assert heads == [
        "Verdict", "Tolerances and assumptions", "Contents", "Summary", *limited,
        "Provenance",
    ]  # fmt: skip
    parts = [
        "<svg", "<h3>Performance", "<h3>Who drives",
        "<h3>Named distribution", "<h3>Contributions", "<h3>The classical",
        "<h3>Integration error", "<h3>Worst trials",
    ]  # fmt: skip
    one = report.text[report.text.index('<h2 id="extra_loss"') :]
    places = [one.index(part) for part in parts]
    assert places == sorted(places)
    assert "with 95 % certainty at most" in one and "bounds no other's" in one
    assert "no probability" in one and "root sum square fails" in one
    for words in ("tolstat trial ", "smooth functions", "normal, +-1.2 mm"):
        assert words in report.text
    assert "source digest" in report.text and "[deviations]" in report.text


def test_the_page_needs_nothing_else(made):
    assert len(made.text.encode()) < 5e6
    assert "script" not in made.page.tags and "link" not in made.page.tags
    for link in made.page.links:
        assert link.startswith(("#", "data:image/png"))
    assert "http" not in re.sub(r'xmlns(:xlink)?="[^"]*"', "", made.text)


def test_every_picture_has_words_and_names_of_its_own(made):
    assert len(made.page.pictures) == len(made.figures)
    assert len(made.figures) > 10
    for picture in made.page.pictures:
        assert picture["role"] == "img" and len(picture["aria-label"]) > 10
    names = re.findall(r'\bid="([^"]+)"', made.text)
    assert len(names) == len(set(names))
    for name in set(re.findall(r'(?:href="#|url\(#)([^")]+)', made.text)):
        assert name in names, name


def test_many_points_are_rasterised(report, toy, toy_study):
    assert "data:image/png" in report.text
    run = tolstat.run(toy_study, model=toy)
    few, _ = page_of(run)
    assert "data:image/png" not in few


def texts_of(figure):
    """Bounding boxes of all words of a figure."""
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    renderer = canvas.get_renderer()
    found = []
    for axes in figure.axes:
        if not axes.axison:
            continue
        shown = [axes.xaxis.label, axes.yaxis.label]
        for axis in (axes.xaxis, axes.yaxis):
            low, high = sorted(axis.get_view_interval())
            ticks = [t for t in axis.get_major_ticks() if low <= t.get_loc() <= high]
            shown += [label for t in ticks for label in (t.label1, t.label2)]
        found += [t for t in shown if t.get_text() and t.get_visible()]
    for legend in figure.legends:
        found += legend.get_texts()
    width, height = canvas.get_width_height()
    return [(t.get_text(), t.get_window_extent(renderer)) for t in found], width, height


def test_no_words_lie_over_others(made):
    for alternative, figure in made.figures:
        boxes, width, height = texts_of(figure)
        for i, (words, box) in enumerate(boxes):
            assert box.x0 > -1 and box.y0 > -1, (alternative, words)
            assert box.x1 < width + 1 and box.y1 < height + 1, (alternative, words)
            for other, there in boxes[i + 1 :]:
                apart = (
                    box.x1 <= there.x0 + 1 or there.x1 <= box.x0 + 1
                    or box.y1 <= there.y0 + 1 or there.y1 <= box.y0 + 1
                )  # fmt: skip
                assert apart, (alternative, words, other)


def test_what_lies_beyond_the_limit_is_coloured(report):
    words = next(w for w, _ in report.figures if "Histogram of jam_share" in w)
    within, beyond = (
        (patch.get_data(), patch.get_facecolor())
        for patch in dict(report.figures)[words].axes[0].patches
    )
    for ((heights, edges, _), colour), sign in ((within, -1), (beyond, 1)):
        drawn = edges[:-1][heights > 0]
        assert (sign * (drawn - 50.0) >= -1e-9).all()  # %
        assert (colour[0] > 0.5) == (sign > 0)
    share = report.found["responses"]["jam_share"]["limited"]["yields"]["out_of_limit"][
        "value"
    ]
    counted = beyond[0].values.sum()
    assert counted == pytest.approx(share * 2200, rel=0.05)


class Quoted(Toy):
    """A toy whose words mean something in HTML."""

    def describe(self, settings):
        gap, ratio = super().describe(settings).responses
        quoted = replace(gap, symbol='"<b>', sentence='a <b> in "quotes"', source="<i>")
        return super().describe(settings)._replace(responses=(quoted, ratio))


HOSTILE = '<script>alert("1")</script> & "quotes" \'ticks\''


def test_texts_of_a_study_are_escaped(toy, toy_study, tmp_path):
    title = HOSTILE.replace('"', '\\"')
    text = toy_study.read_text().replace('title = "toy"', f'title = "{title}"')
    toy_study.write_text(text)
    named = tmp_path / "a \"b\" <i>'c'.h5"
    run = tolstat.run(toy_study, model=Quoted(), output=named)
    page, _ = page_of(replace(run, diagnostics=Diagnostics(missing=HOSTILE)))
    read = Page(page)
    assert "<script" not in page and not {"script", "i", "b"} & set(read.tags)
    assert "&lt;script&gt;" in page and HOSTILE in read.text and named.name in read.text
    assert 'a <b> in "quotes"' in read.text
    page = make_comparison_page(*compared_with_first([run, run]))
    assert "<script" not in page and HOSTILE in Page(page).text
    assert not {"script", "i", "b"} & set(Page(page).tags)


@pytest.mark.parametrize("approval", ["", "A. Engineer, 2026-11-22"])
def test_the_title_block_is_what_the_study_says(toy, toy_study, approval):
    drawing = "رسم <b>\\u202e 7"  # from right to left, and not to be obeyed
    document = f'project = "P-1"\nauthor = " "\ndrawing = "{drawing}"\n'
    text = toy_study.read_text().replace(
        "[deviations]", f'[document]\n{document}approval = "{approval}"\n[deviations]'
    )
    toy_study.write_text(text)
    page, found = page_of(tolstat.run(toy_study, model=toy))
    assert found["document"] == {
        "project": "P-1", "drawing": "رسم <b>\u202e 7", "revision": "", "author": "",
        "approval": approval,
    }  # fmt: skip
    said = first_of(page)
    assert "project P-1 drawing رسم <b>\\u202e 7" in said and "author" not in said
    assert ('class="sign"' in page) == (approval == "")
    assert approval in said and "revision" not in said
    # a foot that a style sheet reads: nothing but letters, figures and their codes
    foot = unescape(re.search(r'style="--sheet: ([^"]*)">', page)[1])
    assert re.fullmatch(r'"(\w|\\[0-9a-f]+ )*"', foot)
    assert '"' not in foot[1:-1] and "\\3c " in foot


def test_slopes_and_the_worst_corner_stand_with_their_units(report, mill):
    words = {path: words for path, _, words in report.page.numbers}
    part = section_of(report.text, "rod_force_1")
    slopes = mill.diagnostics.slopes["rod_force_1"]
    for name, unit, factor in (
        ("rod_length_1", "kN/mm", 1e-6), ("crank_angle_1", "kN/deg", np.pi / 180e3),
    ):  # fmt: skip
        path = f"responses/rod_force_1/slopes/{name}"
        assert says(words[path], factor * slopes[name])
        assert re.search(rf'data-path="{path}">[^<]*</span> {unit}<', part)
        corner = mill.diagnostics.worst_cases["rod_force_1"]["largest"].deviations[name]
        path = f"responses/rod_force_1/worst_cases/largest/deviations/{name}"
        assert says(words[path], mill.scales[name].factor * corner)


def test_a_histogram_says_limit_mean_and_what_is_fitted(report):
    figures = dict(report.figures)
    for name in report.found["interest"]:
        each = report.found["responses"][name]
        words = next(w for w in figures if w.startswith(f"Histogram of {name}:"))
        (legend,) = figures[words].legends
        labels = [text.get_text() for text in legend.get_texts()]
        assert f"limit {each['limited']['limit']['words']}" in labels
        mean = next(label for label in labels if label.startswith("mean"))
        factor = 10.0 ** {"kN": -3, "kN m": -3, "%": 2}[each["scale"]["shown"]]
        assert says(mean.split()[1], factor * each["mean"]["value"])
        shape, fitted = each["distribution"], each["distribution"]["shape"]
        fits = [label for label in labels if label.startswith(fitted["name"])]
        assert bool(fits) == (shape["beyond"] is not None)
        for label in fits:
            assert says(label.split()[1], 1e6 * shape["beyond"])
            curve = next(
                line for line in figures[words].axes[0].lines
                if line.get_label() == label
            )  # fmt: skip
            area = np.trapezoid(curve.get_ydata(), curve.get_xdata())
            bars = np.ptp(curve.get_xdata()) / 60 * shape["rest"]
            assert area == pytest.approx(bars, rel=0.1)


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
    page, _ = page_of(run)
    tables = re.findall(r"<table.*?</table>", page, flags=re.DOTALL)
    numbers = [t for t in tables if "<thead>" in t and "distribution</th>" not in t]
    assert len(numbers) >= 4
    for table in numbers:
        assert re.search(r'data-path="trials/failed">1</span> failed', table)
    assert "if failed trials are good" in page


def test_tidy_finds_nothing(made):
    tidy = shutil.which("tidy")
    if not tidy:
        pytest.skip("no tidy on this machine")
    done = subprocess.run([tidy, "-q", "-e", made.path], capture_output=True, text=True)
    assert done.stderr == "" and done.returncode == 0


@pytest.mark.parametrize(
    ("trials", "deviations"),
    [(1, 'part = "+-0.5 mm"'), (20, 'part = "+-0.5 mm"'), (9, "")],
)
def test_a_few_trials_make_a_page_too(tmp_path, toy, trials, deviations):
    """What cannot be told with one machine is left out, or says why."""
    study = tmp_path / "few.toml"
    head = f'model = "toy"\ntrials = {trials}\nseed = 1\n'
    study.write_text(f"{head}[deviations]\n{deviations}\n[limits]\ngap = '<= 1 mm'\n")
    run = tolstat.run(study, model=toy)
    page, found = page_of(run)
    assert "needs" in page and "undecided" in page
    assert found["responses"]["gap"]["quantiles"]["95 %"]["lower"] is None
    path = tmp_path / "few.html"
    path.write_text(page)
    done = subprocess.run(["tidy", "-q", "-e", path], capture_output=True, text=True)
    assert done.stderr == ""


def test_indices_that_cannot_be_told_say_what_they_need(toy, toy_study):
    text = toy_study.read_text().replace('"+-1 mm"', '"+-0.5 mm"')
    toy_study.write_text(f'sampling = "saltelli"\n{text}')
    page, _ = page_of(tolstat.run(toy_study, model=toy))
    assert "No Sobol' indices: needs 500 groups of 5 trials, 2500 in all" in page
    assert "trials = 2500 or more" in page  # among the notes
    page, _ = page_of(tolstat.run(toy_study, model=toy, trials=2500, force=True))
    assert "No Sobol' indices" not in page


def words_under(page, tag):
    """What stands in all elements of a kind, without their marks."""
    found = re.findall(rf"<{tag}>(.*?)</{tag}>", page, flags=re.DOTALL)
    return [" ".join(re.sub(r"<[^>]*>", "", each).split()) for each in found]


def test_captions_of_groups_count_what_statistics_rest_on(toy, toy_study):
    """Of a run for Sobol' indices: two machines of each group, and whole groups."""
    toy_study.write_text(f'sampling = "saltelli"\n{toy_study.read_text()}')
    run = tolstat.run(toy_study, model=toy, trials=4000)
    page, _ = page_of(run)
    status = run.status.reshape(-1, 5)
    done = np.count_nonzero(status[:, :2] == 1)
    every, whole = run.counts["done"], np.count_nonzero(np.all(status == 1, axis=1))
    assert done < 1600 and every < 4000 and whole < 800
    captions = words_under(page, "caption")
    counts = f"{done} trials done, {1600 - done} failed, of the 1600 that statistics"
    worst = f"of all {every} trials done"
    assert worst in captions
    assert all(counts in each or each == worst for each in captions)
    assert f"{every} of 4000 trials done; statistics rest on 1600: {done} done" in (
        " ".join(re.sub(r"<[^>]*>", "", page).split())
    )
    figures = " ".join(words_under(page, "figcaption"))
    assert f"quantiles of all {done} trials done; {1600 - done} failed" in figures
    assert f"of {whole} groups of trials ({800 - whole} left out" in figures
    assert "as 1600 trials were added" in figures
    assert f"Each of the {done} trials done" in figures


def test_the_caption_of_a_histogram_counts_its_machines(report, mill):
    atoms = {
        name: report.found["responses"][name]["distribution"]
        for name in report.found["interest"]
    }
    captions = words_under(report.text, "figcaption")
    assert any(each["atom"] for each in atoms.values())
    for found in atoms.values():
        words = f"{found['rest']} machines by their values"
        words += ", without those that share one;" if found["atom"] else ";"
        assert any(words in each for each in captions)


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


def pixels(png):
    """Return an array [row, column, channel] from 0 to 1."""
    import io

    import matplotlib.image as image

    return image.imread(io.BytesIO(png), format="png")[:, :, :3]


def test_the_page_is_drawn_in_light_and_in_dark(made, tmp_path):
    light = pixels(look(made.path, tmp_path))
    dark = pixels(look(made.path, tmp_path, dark=True))
    assert np.median(light) > 0.9 and np.median(dark) < 0.2
    # words and pictures stand out in both
    assert (light < 0.3).mean() > 0.01 and (dark > 0.7).mean() > 0.01


def test_the_page_is_as_wide_as_its_window(made, tmp_path):
    widths = [390, 820, 1400]
    found = scroll_widths(made.path, tmp_path, widths)
    assert all(w <= width for w, width in zip(found, widths, strict=True)), found


def test_the_page_prints_on_a4(made, tmp_path):
    pdf = printed(made.path, tmp_path)
    boxes = re.findall(rb"/MediaBox \[0 0 ([\d.]+) ([\d.]+)\]", pdf)
    assert len(boxes) >= 3
    for box in boxes:
        assert [float(side) for side in box] == pytest.approx([595, 842], abs=1.5)


PAPER, TALL = 182 / 25.4 * 96, 267 / 25.4 * 96  # what margins leave of A4, in pixels
SIZES = """(() => {
  const sizes = [], words = document.createTreeWalker(document.body, 4);
  while (words.nextNode()) {
    const of = words.currentNode.parentElement;
    if (words.currentNode.textContent.trim() && !of.closest("svg, script"))
      sizes.push(parseFloat(getComputedStyle(of).fontSize));
  }
  const pictures = [...document.querySelectorAll("figure svg")].map(
    e => e.getBoundingClientRect().width / e.viewBox.baseVal.width);
  const heads = [...document.querySelectorAll("h1, h2, h3")].map(
    e => getComputedStyle(e).breakAfter);
  const first = document.querySelector(".first");
  return {
    words: Math.min(...sizes), pictures: Math.min(...pictures), heads,
    scroll: document.documentElement.scrollWidth,
    first: first && first.getBoundingClientRect().bottom,
  };
})()"""


def test_on_paper_no_word_has_less_than_8_points(made, tmp_path):
    """Nothing is wider than the paper either: all would be printed smaller then."""
    found = asked(made.path, tmp_path, int(PAPER) + 1, SIZES, paper=True)
    assert found["scroll"] <= PAPER + 1
    assert found["words"] * 72 / 96 >= 8
    assert found["pictures"] * 72 / 96 * SMALLEST >= 8
    assert {*found["heads"]} == {"avoid"}
    drawn = [text for _, figure in made.figures for text in figure.findobj(Text)]
    assert min(text.get_fontsize() for text in drawn if text.get_text()) >= SMALLEST
    if "joint" in made.found:  # the first page is one page
        assert 0 < found["first"] < TALL


@pytest.mark.parametrize("long", [False, True])
def test_the_verdict_stays_in_sight_on_a_phone(made, tmp_path, long):
    """Whatever its words are: no column is as wide as these."""
    if long:
        text = made.path.read_text().replace("&lt;= 3 %", "-1234.567 .. 1234.567 kN m")
        (tmp_path / "long.html").write_text(text)
        made = Made(text, made.found, made.figures, tmp_path / "long.html")
    cells = "[...document.querySelectorAll('.verdicts th, .verdicts td')]"
    ends = asked(
        made.path, tmp_path, 390,
        f"{cells}.map(e => [e.getBoundingClientRect().right, e.scrollWidth"
        " - e.clientWidth, getComputedStyle(e).display])",
    )  # fmt: skip
    seen = [end for end in ends if end[2] != "none"]
    rows = 1 + (5 if "joint" in made.found else 2 * 5)
    assert len(seen) == 5 * rows
    assert max(end for end, _, _ in seen) <= 390 - 8
    assert max(over for _, over, _ in seen) <= 1


def first_of(page):
    """What the first page says, without its marks."""
    first = page[page.index('<section class="first">') : page.index("</section>")]
    return " ".join(unescape(re.sub("<[^>]*>", " ", first)).split())


def test_the_first_page_names_culprits_and_what_halving_them_gains(report):
    """For the machines beyond, and for the spread: these need not be the same."""
    sentences = words_under(report.text[: report.text.index("</section>")], "p")
    found = report.found["responses"]["extra_loss"]
    assert found["members"]["rods"] == ["rod_length_1", "rod_length_2"]
    assert found["culprits"]["driving"] == ["rods"]
    apart = "rod_length_1 high with rod_length_2 low, or the other way round"
    rods = next(each for each in sentences if each.startswith(apart))
    beyond = report.found["responses"]["jam_share"]["culprits"]["beyond"]
    assert f"of the {beyond} machines beyond jam_share, either alone in" in rods
    halved = re.findall(
        r"halved (\S+) \(\S+ \.\. \S+\) of a million are beyond jam_share, now (\d+)",
        rods,
    )
    assert len(halved) == 1
    known = report.found["responses"]["jam_share"]
    assert says(halved[0][1], 1e6 * known["limited"]["yields"]["out_of_limit"]["value"])
    gain = known["culprits"]["pairs"][0]["halved"]["value"]
    assert says(halved[0][0], 1e6 * gain) or halved[0][0] == "0"
    contributions = found["contributions"]
    assert contributions["together"]["rods"]["lower"] > 0.5
    assert contributions["together"]["gears"]["reason"].startswith("needs a run with")
    told = [each for each in sentences if "halved" in each or "spread" in each]
    assert len(told) == 3


def test_who_drives_the_machines_beyond_is_told_of_the_stored_columns(report, mill):
    found = report.found["responses"]["jam_share"]["culprits"]
    beyond = mill.column("jam_share") > 0.5
    assert found["beyond"] == beyond.sum() > 10 and found["reason"] == ""
    rod = mill.column("rod_length_1")
    said = found["contributors"]["rod_length_1"]
    off = (rod[beyond] - rod.mean()) / rod.std()
    assert said["shift"] == pytest.approx(off.mean())
    assert said["width"] == pytest.approx(np.sqrt(np.mean(off**2)))
    assert said["width"] > 1.5 and said["level"] < 1e-6
    assert found["contributors"]["crank_angle_1"]["level"] > 0.05
    rods = found["kinds"]["rods"]
    assert rods["level"] < 1e-6 and rods["halved"]["upper"] < 0.01
    stored = mill.diagnostics.halved["jam_share"]["rod_length_1", "rod_length_2"]
    assert rods["halved"]["value"] == stored.beyond.value
    assert rods["effective"] == stored.effective
    phase = found["contributors"]["runout_phase_7"]["halved"]
    assert phase["value"] is None and phase["reason"] == "a full turn is no tolerance"
    part = section_of(report.text, "jam_share")
    part = part[part.index("Who drives") : part.index("<h3>Contributions")]
    assert "<strong>rods</strong>" in part and "<strong>cranks</strong>" not in part


def section_of(page, response):
    start = page.index(f'<h2 id="{response}"')
    return page[start : page.index("</section>", start)]


def test_where_a_few_machines_decide_noise_is_not_drawn(report):
    few = {
        name: report.found["responses"][name]["contributions"]["dominated_by_few"]
        for name in report.found["interest"]
    }
    assert few["extra_loss"] and not few["shaft_9_moment"]
    for name, decide in few.items():
        part = section_of(report.text, name)
        assert ("A few machines decide the variance" in part) == decide
        assert ("Contributions, the largest first" in part) != decide
        assert ("Unexplained" in part) != decide
        assert ("alone, % of the variance" in part) != decide
    part = section_of(report.text, "extra_loss")
    assert re.search(r"at least <span[^>]*together/rods/lower", part)
    # over the rods, that differ among the machines beyond, and over nothing else
    drawn = re.search(r'extra_loss over its leading contributors: ([^"]*)', part)
    assert {*drawn[1].split(", ")} == {"rod_length_1", "rod_length_2"}


def test_no_bar_is_negative(report):
    bars = [f for words, f in report.figures if words.startswith("Contributions, the")]
    assert bars
    for figure in bars:
        assert all(patch.get_width() >= 0 for patch in figure.axes[0].patches)


def test_indices_of_a_few_machines_are_not_drawn(toy, toy_study):
    class Jams(type(toy)):
        def evaluate(self, deviations, settings):
            apart = np.abs(deviations[:, 0] - deviations[:, 1]) / 1e-3
            gap = 1e-3 * np.maximum(apart - 1.4, 0)
            both = np.stack([gap, gap], axis=1)
            return Outcome(both, np.ones(len(gap), dtype=np.int64))

    text = toy_study.read_text().replace("trials = 1000", "trials = 5000")
    toy_study.write_text('sampling = "saltelli"\n' + text)
    page, found = page_of(tolstat.run(toy_study, model=Jams()))
    assert found["responses"]["gap"]["indices"]["dominated_by_few"]
    assert "groups of trials would be noise" in page
    assert "Contributions, the largest first" not in page


def test_trials_that_depend_on_each_other_name_no_culprit(toy, toy_study):
    text = toy_study.read_text().replace("trials = 1000", "trials = 1024")
    toy_study.write_text('sampling = "sobol"\n' + text)
    page, found = page_of(tolstat.run(toy_study, model=toy))
    culprits = found["responses"]["gap"]["culprits"]
    assert culprits["reason"] == "for random trials only"
    assert culprits["beyond"] > 0 and culprits["contributors"] == {}
    assert "gap : culprits are named of random trials only" in first_of(page)


def test_what_no_machine_is_beyond_is_said_once(toy, toy_study):
    """And no spread is told of it before that of a limit in danger."""
    study = toy_study.read_text().replace("+-1 mm", "+-0.5 mm")
    toy_study.write_text(
        study[: study.index("[limits]")]
        + '[limits]\ngap = "<= 1 m"\nratio = "<= 1e6"\n'
    )
    page, _ = page_of(tolstat.run(toy_study, model=toy))
    assert "gap and ratio: no machine beyond." in first_of(page).replace(" :", ":")
    assert "none beyond" not in first_of(page)


def chain(limit, **more):
    """A gap between large dimensions: its numbers need many figures."""
    links = {
        "H": {"nominal": "2450 mm", "tolerance": "+-0.2 mm"},
        "a": {"nominal": "33.33 mm", "tolerance": "+-0.1 mm"},
    }
    return {
        "model": "dimension_chain", "trials": 5000, "seed": 5, "links": links,
        "settings": {"gap": "H - a"}, "limits": {"gap": limit}, **more,
    }  # fmt: skip


@pytest.fixture(scope="module")
def rare(tmp_path_factory):
    limit = {"limit": "2416.30..2417.04 mm", "ppm": 100}
    return tolstat.run(
        chain(limit, sampling="rare"),
        output=tmp_path_factory.mktemp("rare") / "rare.h5",
    )


def test_sentences_out_of_sight_make_no_row_high_on_a_phone(report, tmp_path):
    tables = "[...document.querySelectorAll('section:nth-of-type(2) tbody tr')]"
    height = "e => e.getBoundingClientRect().height"
    high = asked(report.path, tmp_path, 390, f"{tables}.map({height})")
    assert len(high) == 20 and max(high) <= 75


def test_rows_out_of_sight_make_no_row_high_on_a_phone(rare, tmp_path):
    """Commands and intervals stand in one line; a limit breaks behind .. alone."""
    tolstat.report(rare, tmp_path / "rare.html")
    run = tolstat.run(chain("<= 2416.9 mm"), output=tmp_path / "run.h5")
    what_if = CliRunner().invoke(
        main, ["what-if", str(run.path), "H=+-0.1 mm", "-o", str(tmp_path / "w.html")]
    )
    assert what_if.exit_code == 0, what_if.output
    height = "e => e.getBoundingClientRect().height"
    for name, most in (("rare", 40), ("w", 60)):
        rows = f"[...document.querySelectorAll('.dense tbody tr')].map({height})"
        high = asked(tmp_path / f"{name}.html", tmp_path, 390, rows)
        assert len(high) >= 2 and max(high) <= most, name
    lines = (
        "[...document.querySelectorAll('.verdicts .whole')].map(e => {"
        " const line = document.createRange(), tops = [...e.childNodes].flatMap(n => {"
        " if (n.nodeType != 3) return [];"
        " return [...n.data].map((c, i) => { line.setStart(n, i);"
        " line.setEnd(n, i + 1); return [c, line.getBoundingClientRect().top] }) });"
        " return tops.map(([c, t], i) => (i && t > tops[i - 1][1] ? '|' : '') + c)"
        ".join('') })"
    )
    text = (tmp_path / "rare.html").read_text()
    words = re.search(r'class="whole">(.*?)</span>', text)[1]
    assert words == "2416.30..<wbr>2417.04 mm"
    for limit in (
        "0.075..0.3 / 3 mm",
        "2416.30..2417.04 mm",
        "12345.678..12345.789 mm",
    ):
        marked = limit.replace("..", "..<wbr>")
        (tmp_path / "own.html").write_text(text.replace(words, marked))
        (broken,) = asked(tmp_path / "own.html", tmp_path, 390, lines)
        assert broken.replace("|", "") == limit
        assert all(part[-1] in ". " for part in broken.split("|")[:-1]), broken


def test_a_rare_share_within_is_no_hundred_per_cent(rare, tmp_path):
    """Its line ends short of 100 %, or is left out; the ppm speak."""
    page = tolstat.report(rare, tmp_path / "rare.html").read_text()
    found = re.search(r'within/value">([\d.]+)<.*within/upper">([\d.]+)<', page)
    assert found and float(found[1]) < float(found[2]) < 100
    share = rare_findings(rare).within
    near = replace(rare_findings(rare), within=share._replace(
        value=1 - 3e-13, lower=1 - 4e-13, upper=1 - 2e-13
    ))  # fmt: skip
    said = page_of_findings(
        "rare.html", near, title="", unmet=UNMET, stages=STAGES, again=str
    )
    assert "within/value" not in said and "A plain run would need" in said
    assert "per million" in said


@pytest.mark.parametrize("sampling", ["random", "rare"])
def test_a_command_on_a_page_runs_where_the_page_was_made(
    sampling, tmp_path, monkeypatch
):
    """The run is named as it was given, and quoted for a shell."""
    monkeypatch.chdir(tmp_path)
    Path("my runs").mkdir()
    limit = {"limit": "<= 2416.9 mm", "ppm": 100}
    run = tolstat.run(chain(limit, sampling=sampling), output="my runs/gap.h5")
    page = unescape(tolstat.report(run).read_text())
    program, *words = shlex.split(re.search("<code>(tolstat trial.*?)</code>", page)[1])
    done = CliRunner().invoke(main, words)
    assert program == "tolstat" and words[1] == "my runs/gap.h5"
    assert done.exit_code == 0 and "bit for bit as stored" in done.output


def test_kinds_of_machines_not_met_are_said_alike(rare, tmp_path):
    page = tolstat.report(rare, tmp_path / "rare.html").read_text()
    text = " ".join(unescape(re.sub("<[^>]*>", "", page)).split())
    said = [note for note in rare_table(rare).notes if "never met" in note]
    assert len(said) == 1 and text.count(said[0]) == 1
    assert "Interval and verdict leave out" in said[0]


@pytest.mark.parametrize(
    ("demand", "share", "ppk"),
    [
        ({"ppk": 1.33}, "for Ppk 1.33", "demanded 1.33"),
        ({"ppk": 2}, "for Ppk 2", "demanded 2"),
        ({"ppm": 100}, "for 99.99 %", "demanded 1.240"),
        ({"ppm": 10}, "for 99.999 %", "demanded 1.422"),
        ({"ppm": 1e-6}, "for 99.9999999999 %", "demanded 2.345"),
        ({}, "for 99.73 %", "demanded 0.9274"),
    ],
)
def test_what_is_demanded_is_an_exact_number(demand, share, ppk, tmp_path):
    """As it is typed, or of four figures to the nearest: it is no bound."""
    study = chain({"limit": "<= 2416.9 mm", **demand}, trials=100)
    run = tolstat.run(study, output=tmp_path / "run.h5")
    text = " ".join(re.sub("<[^>]*>", "", tolstat.report(run).read_text()).split())
    assert share in text and ppk in text
    ((_, _, asked_for, *_),) = summary_table(run).limit_rows
    assert f"for {asked_for}" == share
