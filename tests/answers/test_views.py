"""Views of any model: as picture, table and page, on the screen."""

from __future__ import annotations

import csv
import io
import re
from dataclasses import replace

import numpy as np
import pytest

import tolstat
from tests.answers.picture_checks import nothing_overlaps
from tests.model.rich import Rich
from tolstat import catalogue
from tolstat.answers.views.evaluate import view_of
from tolstat.answers.views.view_file import as_csv, draw_view, save_view, view_document
from tolstat.cli.main import main
from tolstat.document.inline import Number, in_cell, plain
from tolstat.document.view_content import view_table
from tolstat.errors import ModelError, QuestionError, RunFileError
from tolstat.model.view import Axis, Chart, Curve, Listing, Mark, Offer, Panel, Region
from tolstat.render.page import page as html

STUDY = {
    "model": "rich", "trials": 100, "seed": 1,
    "deviations": {"A1": "+-0.3 mm", "A2": "+-10 um"},
}  # fmt: skip


def shown(view):
    """Heads and cells of a view, as text."""
    table = view_table(view)
    return [column.head for column in table.columns], [
        [
            "".join(plain(in_cell(c)[0]) if isinstance(c, Number) else c for c in main)
            or None
            for main, *_ in row
        ]
        for row in table.rows
    ]


@pytest.fixture
def spectrum():
    return tolstat.view(STUDY, "spectrum", model=Rich())


def test_a_chart_has_tolerance_bands(spectrum):
    alone = tolstat.view(Rich(), "spectrum")
    assert alone.bands == () and spectrum.bands[0].name == "tolerances"
    nominal, band = spectrum.curves[0].values, spectrum.bands[0]
    np.testing.assert_array_equal(nominal, alone.curves[0].values)
    assert np.all(band.lower <= band.upper) and np.all(band.lower[50:] < nominal[50:])
    frame = spectrum.frame()
    assert frame.index.name == "frequency" and "tolerances, upper" in frame
    assert frame.attrs["units"]["phase"] == "rad" and "measured" not in frame
    # from the first drawn machines of the study: the same for more trials
    more = tolstat.view({**STUDY, "trials": 200}, "spectrum", model=Rich())
    np.testing.assert_array_equal(more.bands[0].upper, band.upper)


def test_a_view_has_units_and_no_overlaps(spectrum):
    figure = draw_view(spectrum, "rich: spectrum")
    nothing_overlaps(figure)
    amplitude, phase = figure.axes
    assert amplitude.get_ylabel() == "mm" and phase.get_ylabel() == "deg"
    assert phase.get_xlabel() == "frequency, Hz (shaded: working speed)"
    assert (
        amplitude.get_xscale() == "log" and amplitude.get_title("left") == "Amplitude"
    )
    words = [text.get_text() for text in amplitude.get_legend().get_texts()]
    assert words == [
        "safe", "tolerances", "amplitude: peak 0.9901 mm", "measured", "permitted",
    ]  # fmt: skip
    measured = next(x for x in amplitude.lines if x.get_label() == "measured")
    np.testing.assert_allclose(measured.get_xdata(), [5.0, 20.0])
    np.testing.assert_allclose(measured.get_ydata(), [0.8, 0.2])
    lowest = phase.lines[0].get_ydata().min()
    assert lowest == pytest.approx(-np.degrees(np.arctan(10)))


def test_a_listing_is_a_table(tmp_path):
    found = tolstat.view(Rich(), "designs")
    heads, rows = shown(found)
    assert heads == ["z1", "ratio", "size, mm", "hand"]
    assert rows[0] == ["17", "1", "34", "left"] and len(rows) == 5
    assert found.frame()["z1"].tolist() == [17] * 5
    table = list(csv.reader(io.StringIO(as_csv(found))))
    assert table[0] == ["z1", "ratio", "size [mm]", "hand"]
    assert float(table[2][2]) == pytest.approx(36.0)
    page = html(view_document(found, "designs <b>", "a pair of wheels"))
    assert re.search(r"<td>.*>34<", page) and "designs &lt;b&gt;" in page
    figure = draw_view(found, "designs")
    assert "34" in {
        c.get_text().get_text() for c in figure.axes[0].tables[0].get_celld().values()
    }
    many = Listing((Axis("n", "1"),), (np.arange(100),))
    with pytest.raises(QuestionError, match="100 rows are too many"):
        draw_view(many, "many")


@pytest.mark.parametrize("ending", ["png", "svg", "pdf", "csv", "html"])
@pytest.mark.parametrize("name", ["spectrum", "designs"])
def test_every_file_format(tmp_path, name, ending):
    path = tmp_path / f"view.{ending}"
    save_view(tolstat.view(Rich(), name), path, "rich")
    begins = {"png": b"\x89PNG", "svg": b"<?xml", "pdf": b"%PDF", "html": b"<!DOCTYPE"}
    assert path.read_bytes().startswith(begins.get(ending, b""))
    assert path.stat().st_size > 40
    with pytest.raises(RunFileError, match=r"a view ends in \.png"):
        save_view(tolstat.view(Rich(), name), tmp_path / "view.gif", "rich")


def test_charts_without_panels_get_one_for_each_unit():
    at = np.linspace(0, 1, 5)
    curves = tuple(
        Curve(n, u, "", "", at) for n, u in (("a", "m"), ("b", "N"), ("c", "m"))
    )
    figure = draw_view(Chart(Axis("turns", "1", "1"), at, curves), "plain")
    assert [axes.get_ylabel() for axes in figure.axes] == ["mm", "N"]
    assert figure.axes[1].get_xlabel() == "turns"


def test_logarithmic_axes_read_plain_numbers():
    """Pictures read no mathematical markup: $10^{-2}$ would stand there as it is."""
    at = np.geomspace(0.1, 100.0, 50)
    chart = Chart(
        Axis("frequency", "Hz", logarithmic=True), at, (Curve("a", "kg", "", "", at / 10),),
        panels=(Panel("", ("a",), logarithmic=True),),
    )  # fmt: skip
    figure = draw_view(chart, "plain")
    figure.canvas.draw()
    (axes,) = figure.axes
    ticks = (*axes.get_xticklabels(), *axes.get_yticklabels())
    words = {label.get_text() for label in ticks} - {""}
    assert {"0.01", "0.1", "1", "10", "100"} <= words
    assert all(float(word) > 0 for word in words)
    still = replace(chart, curves=(Curve("a", "kg", "", "", np.full(50, 3.0)),))
    low, high = draw_view(still, "still").axes[0].get_ylim()
    assert 0 < low < 3 < high


def test_a_curve_with_a_gap_keeps_its_size():
    at = np.linspace(0, 1, 5)
    gap = np.array([np.nan, np.nan, 30.0, -20.0, 10.0])
    figure = draw_view(
        Chart(Axis("t", "1", "1"), at, (Curve("a", "kg", "", "", gap),)), ""
    )
    lower, upper = figure.axes[0].get_ylim()
    assert lower < -20 and upper > 30
    still = np.where(np.isfinite(gap), 1e-17, np.nan)
    figure = draw_view(
        Chart(Axis("t", "1", "1"), at, (Curve("a", "kg", "", "", still),)), ""
    )
    assert figure.axes[0].get_ylim() == (-1, 1)


def test_the_history_is_a_view_like_any_other(toy):
    chart = tolstat.view("stand", "history", {"crank_difference": 1e-3})
    moved = tolstat.trajectory("stand", {"crank_difference": 1e-3})
    np.testing.assert_array_equal(chart.frame()["yaw"], moved["yaw"])
    study = tolstat.view("runs/khpt75.toml", "history")
    assert study.axis.name == "time" and study.marks
    with pytest.raises(ModelError, match="has no view history"):
        tolstat.view(toy, "history")
    with pytest.raises(ModelError, match="did you mean 'spectrum'"):
        tolstat.view(Rich(), "spectra")
    with pytest.raises(ModelError, match="a view shows one trial, not 2"):
        tolstat.view(Rich(), "spectrum", {"A1": [0.0, 1.0]})
    with pytest.raises(ModelError, match="a study has settings; change them"):
        tolstat.view(STUDY, "spectrum", settings={"hoop": False}, model=Rich())
    with pytest.raises(ModelError, match="this machine cannot be built: cannot exist"):
        tolstat.view("rolling_block", "history", {"inertia_1": -2.0})


def lying(what):
    """Return what is not a view, or shows what it does not have."""
    at = np.zeros(3)
    line = Curve("a", "m", "", "", at)
    return {
        "nothing": None,
        "short": Chart(Axis("t", "s"), at, (Curve("a", "m", "", "", np.zeros(2)),)),
        "panel": Chart(Axis("t", "s"), at, panels=(Panel("one", ("b",)),)),
        "own": Chart(
            Axis("t", "s"), at, (Curve("a", "m", "", "", at[:2], np.zeros(4)),)
        ),
        "mark": Chart(Axis("t", "s"), at, (line,), marks=(Mark("b", 0.0, 0.0),)),
        "twice": Chart(Axis("t", "s"), at, (line, line)),
        "listing": Listing((Axis("n", "1"), Axis("m", "1")), (at,)),
    }[what]


@pytest.mark.parametrize(
    ("what", "words"),
    [
        ("nothing", "a view is a Chart or a Listing, not NoneType"),
        ("short", "a has 2 values over 3 points"),
        ("panel", "panel 'one' shows b, which the view does not have"),
        ("own", "a has 2 values over 4 points"),
        ("mark", "a mark shows b, which the view does not have"),
        ("twice", "a view has a twice"),
        ("listing", "heads and columns of a view"),
    ],
)
def test_an_inconsistent_view_is_refused(what, words):
    machine = Rich()
    machine.views = (Offer("designs", "", lambda deviations, settings: lying(what)),)
    settings = machine.settings()
    with pytest.raises(ModelError, match=words):
        view_of(machine, settings, "designs")


def test_on_the_command_line(tmp_path, monkeypatch):
    from click.testing import CliRunner

    monkeypatch.setitem(catalogue._custom, "rich", Rich())
    study = tmp_path / "rich.toml"
    study.write_text(
        'model = "rich"\ntrials = 50\nseed = 1\n[deviations]\nA1 = "+-1 um"\n'
    )
    runner = CliRunner()
    shown = runner.invoke(main, ["view", str(study), "designs"])
    assert shown.exit_code == 0 and "34  left" in shown.output
    picture = tmp_path / "spectrum.svg"
    shown = runner.invoke(main, ["view", str(study), "spectrum", "-o", str(picture)])
    assert shown.exit_code == 0 and picture.exists(), shown.output
    listed = runner.invoke(main, ["show", "rich"]).output
    for words in (
        "spectrum",
        "wheels that fit",
        "cannot be mounted",
        "[bold]",
        "[2 kg, 1 kg]",
    ):
        assert words in listed, words
    wrong = runner.invoke(main, ["view", str(study), "spectra"])
    assert wrong.exit_code == 2 and "did you mean 'spectrum'" in wrong.stderr
    wrong = runner.invoke(main, ["view", str(study), "spectrum", "-o", "x.gif"])
    assert wrong.exit_code == 2 and "a view ends in" in wrong.stderr


def test_regions_and_separate_curves_are_in_every_table(spectrum):
    heads, rows = shown(spectrum)
    assert heads == ["curve", "frequency, Hz", "value", "unit"]
    measured = [row for row in rows if row[0] == "measured"]
    assert measured == [
        ["measured", "5", "0.8", "mm"], ["measured", "20", "0.2", "mm"],
    ]  # fmt: skip
    assert sum(row[0] == "safe" for row in rows) == 4
    assert {row[3] for row in rows} == {"mm", "deg"}
    area = Chart(
        Axis("i", "1", "1"),
        np.zeros(0),
        regions=(
            Region("exists", "1", np.array([0.3, 0.7, 0.5]), np.array([1.0, 1.0, 2.0])),
        ),
    )
    assert len(view_table(area).rows) == 3 and as_csv(area).count("exists") == 3
    figure = draw_view(area, "existence")
    assert figure.axes[0].get_xlim() == (0.3, 0.7)


def test_a_scale_of_ratios_and_points_without_a_line():
    at = np.linspace(1, 2, 3)
    curves = (
        Curve("gain", "1", "", "", 10.0**at, shown="1"),
        Curve("seen", "1", "", "", 10.0**at, shown="1", points=True),
    )
    panel = Panel("Gain", ("gain", "seen"), logarithmic=True)
    (axes,) = draw_view(Chart(Axis("t", "s"), at, curves, panels=(panel,)), "x").axes
    assert axes.get_yscale() == "log"
    line, points = axes.lines
    assert line.get_linestyle() == "-" and points.get_linestyle() == "None"
    assert points.get_marker() == "o"
