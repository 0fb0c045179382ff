"""Mechanisms are the models' own geometry; an animation enlarges what is off it."""

from __future__ import annotations

import io
import math
import re

import numpy as np
import pytest
from PIL import Image

import tolstat
from tests.answers.browser import asked
from tests.cli.command_line import call
from tolstat import Axis, Contributor, Description, Model, Outcome, Response
from tolstat.document.scene import scene_of
from tolstat.errors import ModelError
from tolstat.model.checked_views import history_of, mechanism_of
from tolstat.model.mechanism import MOST_FRAMES, Line, Mechanism
from tolstat.study.study import load


@pytest.fixture(scope="module")
def slider(tmp_path_factory):
    path = tmp_path_factory.mktemp("slider") / "run.h5"
    return tolstat.run("runs/slider-crank.toml", trials=50, output=path)


def nominal(path):
    study = load(path)
    row = np.zeros(len(study.description.contributors))
    return study, row, mechanism_of(study.model, row, study.settings)


def test_the_loop_of_a_slider_crank_is_its_closed_form():
    _, _, moved = nominal("runs/slider-crank.toml")
    phi, crank, rod = moved.at, 0.05, 0.15
    assert math.isclose(phi[0], math.radians(60.0)) and len(phi) == 180
    pin = crank * np.column_stack([np.cos(phi), np.sin(phi)])
    slide = pin[:, 0] + np.sqrt(rod**2 - pin[:, 1] ** 2)
    np.testing.assert_allclose(moved.points[:, 0], 0.0)
    np.testing.assert_allclose(moved.points[:, 1], pin, atol=1e-12)
    np.testing.assert_allclose(moved.points[:, 2, 0], slide, atol=1e-12)
    np.testing.assert_allclose(moved.points[:, 2, 1], 0.0, atol=1e-12)
    joined = {line.name: line.points for line in moved.lines}
    assert joined == {"crank": (0, 1), "rod": (1, 2), "slide": (2, 0)}


def test_rods_of_the_stand_are_as_long_as_their_force_stretches_them():
    study, row, _ = nominal("runs/khpt75.toml")
    names = [part.name for part in study.description.contributors]
    row[names.index("crank_difference")] = 2e-3
    row[names.index("rod_length_1")] = -1e-3
    moved = mechanism_of(study.model, row, study.settings)
    forces = {bar.name: bar.values for bar in moved.bars}
    for i, length in ((1, 2.449), (2, 2.45)):
        (line,) = (x for x in moved.lines if x.name == f"crank and rod {i}, side")
        axis, pin, hinge = (moved.points[:, point] for point in line.points)
        rod = np.hypot(*(hinge - pin).T)
        np.testing.assert_allclose(9.4e7 * (rod - length), forces[f"rod_force_{i}"],
                                   atol=1e-3)  # fmt: skip
        crank = 0.35 + (-1e-3 if i == 1 else 1e-3)
        np.testing.assert_allclose(np.hypot(*(pin - axis).T), crank)
    chart, _ = history_of(study.model, row, study.settings, 1e-3)
    (yaw,) = (curve.values for curve in chart.curves if curve.name == "yaw")
    (carriage,) = (line for line in moved.lines if line.name == "carriage")
    left, right = (moved.points[:, point] for point in carriage.points[:2])
    turned = np.arctan2(*(left - right)[:, ::-1].T * [[1], [-1]])
    at = np.interp(moved.at, chart.at, yaw)
    assert np.abs(turned).max() > 1e-3
    assert np.abs(turned - at).max() < 0.02 * np.abs(yaw).max()


def test_the_tool_stands_as_deep_in_the_ring_as_it_cuts():
    study, row, moved = nominal("runs/ring.toml")
    step = float(moved.at[1])
    chart, _ = history_of(study.model, row, study.settings, step)
    (depth,) = (curve.values for curve in chart.curves if curve.name == "depth_min")
    below, edge = 30, 60  # the paper's angle pi, and the tool there
    seen = -moved.points[:, below, 1] + moved.points[:, edge, 1]
    np.testing.assert_allclose(seen, depth, atol=1e-9)


def test_deviations_are_enlarged_as_the_picture_says(slider):
    animation = slider_animation(slider)
    scene = animation.scene
    times = int(re.search(r"drawn (\d+) times", scene.words)[1])
    assert times > 1 and "Grey: the nominal machine." in scene.words
    unit, rest = (one_mechanism(slider, number) for number in (7, None))
    first = [scene.points[:, i].astype(float) for i in (0, 1, 2)]
    grey = [scene.nominal[:, i].astype(float) for i in (0, 1, 2)]
    per_metre = np.abs(grey[2] - grey[0]).max() / np.abs(rest.points[:, 2, 0]).max()
    off = (unit.points - rest.points)[:, 2, 0]
    drawn = (first[2] - grey[2])[:, 0] / per_metre
    np.testing.assert_allclose(drawn, times * off, atol=2 / per_metre)
    assert scene.labels[0].startswith("phi 60.") and len(scene.labels) == 180


def slider_animation(run):
    return tolstat.replay(run, 7).animate()


def one_mechanism(run, number):
    found = tolstat.replay(run, number)
    model, settings = found.built
    return mechanism_of(model, np.array([*found.deviations.values()]), settings)


def test_a_page_moves_by_its_own_script_alone(slider, tmp_path):
    page = slider_animation(slider).save(tmp_path / "moving.html")
    text = page.read_text("utf-8")
    assert not re.search(r"""(src|href)=["'](?!#)|https?://(?!www\.w3)|fetch\(""", text)
    script = text.split("<script>")[1].split("</script>")[0]
    assert len(script.splitlines()) <= 100 and "prefers-reduced-motion" in script
    move = (
        "(() => { const s = document.querySelector('input'); s.value = 45;"
        " s.dispatchEvent(new Event('input'));"
        " return [document.querySelector('.label').textContent,"
        " document.querySelector('button').textContent,"
        " document.querySelectorAll('polyline')[3].getAttribute('points')]; })()"
    )
    scene = slider_animation(slider).scene
    label, button, places = asked(page, tmp_path, 800, move)
    assert label == scene.labels[45] and button == "Play"
    assert places == " ".join(f"{x},{y}" for x, y in scene.points[45, :2].tolist())


def test_a_gif_has_all_frames(slider, tmp_path):
    done = call("trial", slider.path, 7, "--animate", tmp_path / "moving.gif")
    assert done.exit_code == 0 and "moving.gif" in done.output
    with Image.open(io.BytesIO((tmp_path / "moving.gif").read_bytes())) as image:
        assert image.n_frames == 180 and image.info["loop"] == 0
        assert image.info["duration"] == 50


def test_a_notebook_shows_it_in_a_frame(slider):
    assert slider_animation(slider)._repr_html_().startswith("<iframe srcdoc=")


def test_a_model_without_a_mechanism_is_refused_with_those_that_have_one(tmp_path):
    page = tmp_path / "page.html"
    for study, words in (
        ("runs/rolling-block.toml", ("stand", "dimension_chain", "ring")),
        ("runs/stack-up.toml", ("[loops]",)),
    ):
        done = call("trial", study, "--nominal", "--animate", page)
        assert done.exit_code == 1 or done.exit_code == 2
        assert all(word in done.output for word in words), done.output
        assert not page.exists()
    done = call("trial", "runs/slider-crank.toml", "--nominal", "--animate", "x.png")
    assert done.exit_code == 2 and ".gif" in done.output


def test_lots_and_cases_animate_their_model():
    study = {
        "model": "dimension_chain", "trials": 8, "seed": 1,
        "links": {
            "a": {"nominal": "50 mm", "tolerance": "+-0.1 mm"},
            "b": {"nominal": "150 mm"},
            "phi": {"nominal": "60 deg"},
        },
        "loops": {"main": "a @ phi + b @ theta - s @ 0 deg"},
        "deviations": {"a_lot": "+-0.2 mm"},
        "cases": {"cold": {"b": "149 mm"}, "hot": {"b": "151 mm"}},
    }  # fmt: skip
    run = tolstat.run(study)
    moved = tolstat.replay(run, 3)
    model, settings = moved.built
    row = np.array([*moved.deviations.values()])
    mechanism = mechanism_of(model, row, settings)
    length = 0.05 + moved.deviations["a"] + moved.deviations["a_lot"]
    np.testing.assert_allclose(np.hypot(*mechanism.points[:, 1].T), length)
    reach = np.hypot(*(mechanism.points[:, 2] - mechanism.points[:, 1]).T)
    np.testing.assert_allclose(reach, 0.149)
    assert mechanism.sentence.startswith("Case cold")


class Own(Model):
    name = "own"

    def describe(self, settings):
        return Description((Contributor("a", "m"),), (Response("b", "m"),))

    def evaluate(self, deviations, settings):
        return Outcome(deviations)

    def mechanism(self, deviations, settings):
        return self.moved


def made(points, **more):
    at = np.arange(float(len(points)))
    return Mechanism(Axis("time", "s"), at, np.asarray(points), **more)


@pytest.mark.parametrize(("moved", "words"), [
    ("three rods", "not str"),
    (made(np.zeros((3, 2)), lines=()), "[frame, point, 2]"),
    (made(np.zeros((3, 1, 2)), lines=(Line("rod", (0, 1)),)), "line rod"),
    (made(np.zeros((MOST_FRAMES + 1, 1, 2)), lines=()), "frames"),
    (made(np.zeros((3, 1, 2)), lines=(), reference=np.zeros((2, 1, 2))), "reference"),
])  # fmt: skip
def test_a_mechanism_that_does_not_fit_together_is_named(moved, words):
    model = Own()
    model.moved = moved
    with pytest.raises(ModelError, match=re.escape(words)) as error:
        mechanism_of(model, np.zeros(1), None)
    assert "'own'" in str(error.value)


def test_frames_after_a_failure_are_left_out():
    points = np.zeros((4, 2, 2))
    points[:, 1, 0] = 1.0
    points[3] = np.nan
    moved = made(points, lines=(Line("rod", (0, 1)),))
    assert len(scene_of(moved, None).points) == 3
    assert not len(scene_of(made(points[3:], lines=()), None).points)
