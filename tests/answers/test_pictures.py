"""Pictures: content, units on every axis, no overlaps."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import tolstat
from tests.answers.picture_checks import nothing_overlaps
from tolstat.answers.sweep.curves import save_sweeps, sweep_plot, sweeps, swept_axis
from tolstat.answers.views.replay import replay
from tolstat.answers.views.view_file import draw_view
from tolstat.errors import QuestionError, RunFileError
from tolstat.machines.stand.declarations import Settings
from tolstat.machines.stand.machine import Stand
from tolstat.model.view import Axis, Chart, Curve, Panel
from tolstat.render.figures import draw
from tolstat.render.picture import picture


def draw_sweeps(runs, responses=()):
    return draw(sweep_plot(runs, responses), runs[0].title)


@pytest.fixture(scope="module")
def machine(tmp_path_factory):
    path = tmp_path_factory.mktemp("pictures") / "run.h5"
    return replay(tolstat.run("runs/khpt75.toml", trials=3, output=path), 1)


@pytest.fixture(scope="module")
def grid(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pictures")
    (folder / "points.csv").write_text(
        "crank_difference [mm],extra_loss_run [%]\n0.5,0.003\n1.5,2.89\n"
    )
    study = folder / "grid.toml"
    study.write_text(
        'model = "stand"\nsampling = "grid"\n'
        '[grid]\ncrank_difference = { from = "0 mm", to = "3 mm", points = 7 }\n'
        'contact_yaw = ["geometry", "fig4"]\n'
        '[reference]\ndata = "points.csv"\nlabel = "known"\n'
        '[limits]\nextra_loss_run = "<= 3 %"\nyaw = "-2..2 mrad"\n'
    )
    return tolstat.run(study)


def test_histories(machine):
    figure = draw_view(machine.history, "khpt75: trial 1")
    nothing_overlaps(figure)
    labels = [axes.get_ylabel() for axes in figure.axes]
    assert labels == ["kN m", "kN", "mrad", "mm", "kW", "kW", "m/s"]
    assert "time, s" in figure.axes[5].get_xlabel()
    rods = figure.axes[1].get_legend().get_texts()
    found = machine.responses["rod_force_1"].value
    assert f"{found / 1e3:.1f} kN" in rods[0].get_text()
    # the mark lies on the curve, in the window
    curve, mark = figure.axes[1].lines[:2]
    (time,), (value,) = mark.get_data()
    x, y = curve.get_data()
    (window,) = machine.history.spans
    assert window.lower <= time <= window.upper
    assert value == y[np.searchsorted(x, time)]
    assert abs(value) == pytest.approx(found / 1e3, rel=1e-4)


def test_a_history_without_yaw():
    settings = Settings(variant="equalized", drive="balanced")
    chart, _ = Stand().history(np.zeros(46), settings, 1e-3)
    figure = draw_view(chart, "balanced")
    nothing_overlaps(figure)


def test_curves_of_a_grid(grid):
    assert swept_axis(grid) == "crank_difference"
    found = sweeps(grid, "crank_difference", "extra_loss_run")
    assert [s.label for s in found] == ["contact_yaw geometry", "contact_yaw fig4"]
    for sweep, yaw in zip(found, ("geometry", "fig4"), strict=True):
        rows = grid.column("contact_yaw") == yaw
        np.testing.assert_array_equal(sweep.y, grid.column("extra_loss_run")[rows])
    figure = draw_sweeps([grid])
    nothing_overlaps(figure)
    loss, yaw = figure.axes
    assert loss.get_ylabel() == "extra_loss_run, %" and yaw.get_ylabel() == "yaw, mrad"
    assert yaw.get_xlabel() == "crank_difference, mm"
    words = [t.get_text() for t in loss.get_legend().get_texts()]
    assert words == [
        "contact_yaw geometry", "contact_yaw fig4", "known", "limit <= 3 %",
    ]  # fmt: skip
    assert loss.lines[1].get_ydata()[-1] == pytest.approx(8.08, abs=0.02)
    assert list(loss.lines[2].get_xdata()) == pytest.approx([0.5, 1.5])
    both = draw_sweeps([grid, grid], ["rod_force_1"])
    assert len(both.axes[0].lines) == 4


def test_an_axis_has_the_name_of_its_setting(tmp_path):
    """Also where a contributor has the same name: no prefix is drawn."""
    text = Path("runs/elastic-machine-rule.toml").read_text()
    study = tmp_path / "rule.toml"
    study.write_text(text.replace("points = 192", "points = 3"))
    run = tolstat.run(study)
    assert swept_axis(run) == "settings.start_up_time"
    (axes,) = draw_sweeps([run]).axes
    assert axes.get_xlabel() == "start_up_time, s"


def test_a_grid_of_names_is_plotted_over_names(toy, tmp_path):
    study = tmp_path / "words.toml"
    study.write_text(
        'model = "toy"\nsampling = "grid"\n[grid]\nmode = ["odd", "plain"]\n'
        '[limits]\ngap = ">= 0 mm"\n'
    )
    run = tolstat.run(study, model=toy)
    (axes,) = draw_sweeps([run]).axes
    assert axes.get_xlabel() == "mode"
    assert list(axes.lines[0].get_xdata()) == [0.0, 1.0]
    words = {tick.get_text(): x for tick, x in
             zip(axes.get_xticklabels(), axes.get_xticks(), strict=True)}  # fmt: skip
    assert words == {"odd": 0.0, "plain": 1.0}


def test_the_same_picture_is_the_same_file(grid, tmp_path):
    for name in ("a.svg", "b.svg", "a.png", "a.pdf"):
        path = tmp_path / name
        path.write_bytes(picture(draw_sweeps([grid]), path.suffix))
    assert (tmp_path / "a.svg").read_bytes() == (tmp_path / "b.svg").read_bytes()
    assert (tmp_path / "a.png").read_bytes()[1:4] == b"PNG"
    assert (tmp_path / "a.pdf").read_bytes()[:4] == b"%PDF"


def test_refusals_of_pictures(grid, toy, toy_study, tmp_path):
    random = tolstat.run(toy_study, model=toy, trials=5)
    with pytest.raises(QuestionError, match="only a run with sampling"):
        draw_sweeps([random])
    with pytest.raises(QuestionError, match="did you mean 'extra_loss'"):
        draw_sweeps([grid], ["extra_los"])
    with pytest.raises(RunFileError, match=r"\.png, \.svg or \.pdf"):
        save_sweeps([grid], tmp_path / "picture.gif")
    with pytest.raises(RunFileError, match="cannot be written"):
        save_sweeps([grid], tmp_path / "nowhere" / "picture.png")
    words = tmp_path / "words.toml"
    words.write_text('model = "toy"\nsampling = "grid"\n[grid]\nmode = ["odd"]\n')
    with pytest.raises(QuestionError, match="two values or more"):
        draw_sweeps([tolstat.run(words, model=toy)])
    other = tmp_path / "other.toml"
    other.write_text('model = "toy"\nsampling = "grid"\n[grid]\ngain = [1, 2]\n')
    run = tolstat.run(other, model=toy)
    with pytest.raises(QuestionError, match="sweeps crank_difference"):
        draw_sweeps([grid, run])
    with pytest.raises(QuestionError, match="name the responses"):
        draw_sweeps([run])


def test_labels_have_the_same_place_in_all_runs(toy, tmp_path):
    runs = []
    for i, words in enumerate(('"plain", "odd"', '"odd", "plain"')):
        study = tmp_path / f"{i}.toml"
        study.write_text(
            f'model = "toy"\nsampling = "grid"\n[grid]\nmode = [{words}]\n'
        )
        runs.append(tolstat.run(study, model=toy))
    draw_sweeps(runs[:1], ["gap"])
    with pytest.raises(QuestionError, match=r"mode plain odd, .* mode odd plain;"):
        draw_sweeps(runs, ["gap"])


@pytest.mark.parametrize("logarithmic", [False, True])
def test_no_dot_is_on_the_end_of_an_axis(logarithmic):
    """A curve beside which dots stand leaves them room; one without goes to the end."""
    axis = Axis("machines beyond", "1", "ppm", logarithmic)
    at, values = np.array([0.001, 0.01, 0.1]), np.array([3.0, 2.0, 1.0])
    curve = Curve("cheapest", "1", "", "", values)
    least, cost = np.array([0.0001]), np.array([2.5])
    dot = Curve("as drawn", "1", "", "", cost, least, points=True)
    for curves, ends in (((curve, dot), (100, 1e5)), ((curve,), (1000, 1e5))):
        panel = Panel("cost", tuple(each.name for each in curves))
        figure = draw_view(Chart(axis, at, curves, panels=(panel,)), "stack")
        (axes,) = figure.axes
        axes.get_xlim()  # it settles them
        places = axes.transData.transform([(end, 2.0) for end in ends])
        left, right = axes.transAxes.inverted().transform(places)[:, 0]
        room = dot in curves
        assert (left > 0.02) == room and (right < 0.98) == room
