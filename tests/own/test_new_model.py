"""The model that `tolstat new --model` writes runs, and is right."""

from __future__ import annotations

import contextlib

import numpy as np
import pytest
from click.testing import CliRunner
from scipy.integrate import solve_ivp

import tolstat
from tolstat import catalogue
from tolstat.cli.main import main

MODEL = "press_2.py:Press2"


def called(folder, *words, code=0):
    with contextlib.chdir(folder):
        done = CliRunner().invoke(main, words)
    assert done.exit_code == code, done.output
    return done.output


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("press")
    assert called(place, "new", "--model", "press_2.py") == "model in press_2.py\n"
    return place


def by_events(motor_on=2.0, end=3.0):
    """Peak force, largest travel and energy lost, phase by phase, by DOP853."""
    r, l, m, gap, k = 0.1, 0.4, 10.0, 0.48, 2e5

    def place(phi):
        return r * np.cos(phi) + np.sqrt(l**2 - (r * np.sin(phi)) ** 2)

    def slopes(phi, step=1e-4):
        """Slopes of the slider's place over the angle, by central differences."""
        before, here, after = place(phi - step), place(phi), place(phi + step)
        return (after - before) / (2 * step), (after - 2 * here + before) / step**2

    def forces(y, on, touches):
        phi, w, _ = y
        g, h = slopes(phi)
        buffer = (k * (place(phi) - gap) + 2e3 * g * w) * touches
        load = 20.0 * g * w + buffer
        turning = 50.0 * (1.0 - w / 30.0) * on - g * load - m * g * h * w**2
        e = turning / (2.0 + m * g**2)
        push = m * (g * e + h * w**2) + load
        return e, 20.0 * (g * w) ** 2, push / np.sqrt(1 - (r / l * np.sin(phi)) ** 2)

    t, y, touches, force, travel = 0.0, [np.pi / 2, 0.0, 0.0], False, 0.0, 0.0
    while t < end:
        on = t < motor_on

        def contact(t, y):
            return place(y[0]) - gap

        contact.terminal, contact.direction = True, -1 if touches else 1
        found = solve_ivp(
            lambda t, y, on=on, now=touches: (y[1], *forces(y, on, now)[:2]),
            (t, motor_on if on else end), y, "DOP853", events=contact, rtol=1e-10,
            atol=1e-11, max_step=1e-3,
        )  # fmt: skip
        force = max(force, np.abs(forces(found.y, on, touches)[2]).max())
        travel = max(travel, (place(found.y[0]) - gap).max())
        t, y = found.t[-1], found.y[:, -1]
        touches ^= found.status == 1
    return force, travel, y[2]


def test_it_is_right(folder):
    model = catalogue.load(f"{folder / 'press_2.py'}:Press2")
    found = tolstat.evaluate(model).iloc[0]
    np.testing.assert_allclose(
        found[["rod_force", "travel", "lost"]].to_numpy(float), by_events(), rtol=1e-4
    )


def test_its_study_runs_and_a_trial_is_drawn(folder):
    called(folder, "new", "press_2", "--machine", MODEL, "-o", "press.toml")
    study = folder / "press.toml"
    text = study.read_text().replace("# crank =", "crank =").replace("4096", "64")
    study.write_text(text.replace('# rod_force = "<= 1 N"', 'rod_force = "<= 4.1 kN"'))
    said = called(folder, "run", "press.toml", "--machine", MODEL)
    assert "64 trials done, 0 failed" in said
    replay = "trial", "press.h5", "0", "--plot", "motion.png", "--machine", MODEL
    assert "bit for bit as stored" in called(folder, *replay)


@pytest.mark.parametrize("name", ["2nd.py", "press.txt", "class.py", "a-b.py"])
def test_a_name_that_python_cannot_import_is_refused(folder, name):
    assert "such as slider_crank.py" in called(folder, "new", "--model", name, code=2)


def test_an_existing_model_is_kept(folder):
    before = (folder / "press_2.py").read_text()
    said = called(folder, "new", "--model", "press_2.py", code=2)
    assert "press_2.py exists; give another name" in said
    assert (folder / "press_2.py").read_text() == before


@pytest.mark.parametrize("words", [(), ("stand", "--model", "a.py")])
def test_either_a_study_or_a_model(folder, words):
    assert "give a MODEL for a study" in called(folder, "new", *words, code=2)
