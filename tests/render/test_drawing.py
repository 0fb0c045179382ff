"""Figures of a page: numbers stand where values are drawn; many dots take little."""

from __future__ import annotations

import re

import numpy as np
import pytest

from tolstat.document.plot import (
    Bars,
    Histogram,
    Intervals,
    Mark,
    Plot,
    PlotAxis,
    PlotPanel,
    curve,
)
from tolstat.model.view import Band
from tolstat.render.drawing import as_svg
from tolstat.render.figures import draw
from tolstat.render.panels import width_of

DOT = r'<path transform="scale\(([\d.]+)\)" d="M(-?[\d.]+) (-?[\d.]+)h0"'
WORDS = r'<text x="([\d.]+)" y="([\d.]+)" text-anchor="(\w+)">(-?[\d.e+-]+)</text>'
VALUES = {
    "": [-0.5, 0.0, 0.5, 1.0, 1.5, 2.0],
    "log": [0.01, 0.1, 1.0, 10.0, 100.0],
    "symlog": [-100.0, -10.0, 0.0, 10.0, 100.0],
}


def drawn(values, scale):
    """Places of dots, one curve each, and of numbers along both axes."""
    dots = [curve(np.array([v]), np.array([v]), look="large") for v in values]
    panel = PlotPanel(PlotAxis("", scale), PlotAxis("", scale), tuple(dots))
    svg = as_svg(Plot((panel,), width=5.0, height=4.0), "dots")
    sized = [[float(x) for x in each] for each in re.findall(DOT, svg)]
    places = {v: (s * x, s * y) for v, (s, x, y) in zip(values, sized, strict=True)}
    return places, re.findall(WORDS, svg)


@pytest.mark.parametrize("scale", VALUES)
def test_numbers_stand_where_their_values_are(scale):
    places, numbers = drawn(VALUES[scale], scale)
    seen = {"middle": 0, "end": 0}
    for x, y, anchor, words in numbers:
        if float(words) in places:
            seen[anchor] += 1
            across, down = places[float(words)]
            if anchor == "middle":  # below the axis
                assert float(x) == pytest.approx(across, abs=0.1)
            else:  # a third of a letter below its line
                assert float(y) - 8.4 / 3 == pytest.approx(down, abs=0.1)
    assert min(seen.values()) >= 3


def test_numbers_of_a_probability_scale_are_quantiles():
    """By SciPy: distances along the axis are those of normal scores."""
    from scipy.stats import norm

    shares = np.linspace(0.001, 0.999, 9)
    panel = PlotPanel(PlotAxis(""), PlotAxis("", "normal"), (curve(shares, shares),))
    svg = as_svg(Plot((panel,), height=4.0), "shares")
    ends = [(float(y), float(w)) for _, y, a, w in re.findall(WORDS, svg) if a == "end"]
    down, per_cent = np.array(sorted(ends)).T
    assert len({*per_cent}) == len(per_cent) >= 7
    scores = norm.ppf(per_cent / 100)
    slope = np.diff(down) / np.diff(scores)
    assert slope == pytest.approx(np.full(len(slope), slope.mean()), rel=0.02)


def test_numbers_tell_small_counts_and_close_values_apart():
    """Also where a symmetric axis is linear, and far from zero."""
    low = np.array([0.0, 1.0])
    counts = PlotPanel(PlotAxis(""), PlotAxis("", "symlog"), (curve(low, 5 * low),))
    close = PlotPanel(PlotAxis(""), PlotAxis(""), (curve(low, 1e9 + low / 1000),))
    for panel, parts in ((counts, 5), (close, 5)):
        svg = as_svg(Plot((panel,)), "numbers")
        numbers = [words for _, _, a, words in re.findall(WORDS, svg) if a == "end"]
        assert len({*numbers}) == len(numbers) >= parts


def test_long_words_stay_in_the_figure():
    """Of names in legends and below axes, and of marks at the right end."""
    x, name = np.array([0.0, 1.0]), "a_name_of_sixty_letters" + "_" * 37
    line, mark = curve(x, x, name=name), Mark(1.0, "USL 1234.567891")
    marked, plain = (
        PlotPanel(PlotAxis(name), PlotAxis(""), layers)
        for layers in ((line, mark), (line,))
    )
    for plot in (Plot((marked,)), Plot((plain,) * 3, side_by_side=True, width=7.0)):
        svg = as_svg(plot, "names")
        words = re.findall(r'<text x="(.*?)" y=".*?" text-anchor="(.*?)">(.*?)<', svg)
        assert sum("…" in word for *_, word in words) >= 2
        for place, anchor, word in words:
            before = {"start": 0.0, "middle": 0.5, "end": 1.0}[anchor]
            start = float(place) - before * width_of(word)
            assert 0 <= start <= 72 * plot.width - width_of(word)


def test_many_dots_are_a_few_elements():
    x, y = np.random.default_rng(1).normal(size=(2, 50_000))
    panel = PlotPanel(PlotAxis("x"), PlotAxis("y"), (curve(x, y, look="faint"),))
    svg = as_svg(Plot((panel,)), "cloud")
    assert svg.count("<path") < 60 and len(svg) < 400_000
    assert svg.count("h0") > 10_000


def test_bars_stand_on_zero():
    """The axis begins there; the highest bar has room above it."""
    bars = Histogram(np.arange(4.0), np.array([1.0, 3.0, 2.0]))
    svg = as_svg(Plot((PlotPanel(PlotAxis(""), PlotAxis(""), (bars,)),)), "bars")
    (box,) = re.findall(r'<rect x=".*?" y="(.*?)" width=".*?" height="(.*?)"', svg)
    top, bottom = float(box[0]), float(box[0]) + float(box[1])
    outline = re.search(r'<path d="(M[^"]*Z)" style="fill:#', svg)[1]
    down = [float(y) for _, y in re.findall(r"([\d.]+) ([\d.]+)", outline)]
    assert max(down) == pytest.approx(bottom, abs=0.1)
    assert min(down) == pytest.approx(bottom - (bottom - top) / 1.05, abs=0.1)


def test_gaps_are_left_and_what_is_missing_is_no_error():
    """A band with a gap is two areas; a bar without a value is none."""
    nan, at = np.nan, np.arange(5.0)
    lower = np.array([nan, 0.0, nan, 0.0, 0.0])
    band = Band("range", "1", lower, lower + 1, colour="first")
    panel = PlotPanel(PlotAxis(""), PlotAxis(""), (band,), at=at)
    bars = Bars(("a", "b"), np.array([1.0, nan]))
    single = PlotPanel(PlotAxis(""), PlotAxis(""), (bars,))
    ends = Intervals(at[:1], at[1:2], at[:1])  # all trials share one value: no bars
    alone = PlotPanel(PlotAxis(""), PlotAxis(""), (ends,))
    for each, areas in ((panel, 2), (single, 1), (alone, 0)):
        svg = as_svg(Plot((each,)), "gaps")
        drawn = re.findall(r'<path d="(M[^"]*Z)" style="fill:#0072b2"', svg)
        entries = 1 if each is panel else 0  # of the legend
        assert sum(path.count("M") for path in drawn) == areas + entries
        (axes,) = draw(Plot((each,)), "gaps").axes
        assert len(axes.patches) == areas


@pytest.mark.parametrize("value", [0.0, 1.0, -1e-12, 1e12, 1.7e308])
@pytest.mark.parametrize("scale", ["", "symlog", "log"])
def test_equal_values_have_an_axis(value, scale):
    values = np.full(3, value)
    panel = PlotPanel(PlotAxis("", scale), PlotAxis(""), (curve(values, values),))
    bars = PlotPanel(PlotAxis(""), PlotAxis(""), (Bars(("a", "b"), values[:2]),))
    for plot in (panel, bars):
        svg = as_svg(Plot((plot,)), "equal")
        assert "nan" not in svg and "inf" not in svg
        assert re.search(WORDS, svg)
        draw(Plot((plot,)), "equal").canvas.draw()


def test_many_panels_have_a_height_in_a_low_figure():
    at = np.array([0.0, 1.0])
    panel = PlotPanel(PlotAxis("x"), PlotAxis("y"), (curve(at, at, name="curve"),))
    plot = Plot((panel,) * 12, height=2.5, legends=True)
    figure = draw(plot, "twelve")
    places = [axes.get_position() for axes in figure.axes]
    assert min(72 * figure.get_figheight() * place.height for place in places) > 20
    heights = re.findall(r'<rect [^>]*height="(-?[\d.]+)"', as_svg(plot, "twelve"))
    assert len(heights) == 12 and min(map(float, heights)) > 20
    lower = [place.y0 for place in places[:-1]]
    assert all(y > place.y1 for y, place in zip(lower, places[1:], strict=True))


def test_words_up_an_axis_are_apart():
    """Rows of bars in a file, by Matplotlib; bars have room; normal scores."""
    names = tuple(f"row {i}" for i in range(8))
    bars = Bars(names, np.arange(8.0), words=("1.499999996e6 to 1.500000004e6",) * 8)
    plot = Plot((PlotPanel(PlotAxis(""), PlotAxis(""), (bars,)),), height=1.7)
    figure = draw(plot, "bars")
    figure.canvas.draw()
    (axes,) = figure.axes
    boxes = sorted(label.get_window_extent().y0 for label in axes.get_yticklabels())
    high = axes.get_yticklabels()[0].get_window_extent().height
    assert min(np.diff(boxes)) >= high
    score = PlotAxis("", "normal")
    dots = curve(np.array([0.0, 1.0]), np.array([1e-7, 1 - 1e-7]))
    svg = as_svg(Plot((PlotPanel(PlotAxis(""), score, (dots,)),)), "scores")
    heights = sorted(float(y) for _, y, a, _ in re.findall(WORDS, svg) if a == "end")
    assert min(np.diff(heights)) >= 8.3 and len(heights) > 6
    assert axes.get_window_extent().width >= 36 * figure.dpi / 72
