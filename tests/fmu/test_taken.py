"""What responses take of values over time, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from tolstat.errors import ModelError
from tolstat.fmu.taken import Taken, take

TIME = np.linspace(0.0, 1.0, 2001)
WAVE = np.sin(2 * np.pi * TIME)


@pytest.mark.parametrize(
    ("kind", "side", "level", "expected"),
    [
        ("end", "", 0.0, WAVE[-1]),
        ("max", "", 0.0, 1.0),
        ("min", "", 0.0, -1.0),
        ("peak", "", 0.0, 1.0),
        ("mean", "", 0.0, 0.0),
        ("integral", "", 0.0, 0.0),
        ("time", "above", 0.5, 1 / 3),
        ("time", "below", 0.5, 2 / 3),
        ("time", "above", 2.0, 0.0),
        ("time", "below", 2.0, 1.0),
    ],
)
def test_a_sine(kind, side, level, expected):
    assert take(kind, side, level, TIME, WAVE) == pytest.approx(expected, abs=1e-6)


def test_lines_are_exact_with_unequal_steps_and_a_jump():
    time = np.array([0.0, 0.1, 0.1, 0.5, 2.0])  # two points at an event
    values = np.array([0.0, 1.0, -3.0, 1.0, 1.0])
    assert take("integral", "", 0, time, values) == pytest.approx(0.05 - 0.4 + 1.5)
    assert take("mean", "", 0, time, values) == pytest.approx(1.15 / 2)
    assert take("time", "above", 0.0, time, values) == pytest.approx(0.1 + 0.1 + 1.5)
    assert take("peak", "", 0, time, values) == 3.0


def test_a_level_that_is_touched_is_not_above():
    flat = np.ones(3)
    assert take("time", "above", 1.0, np.arange(3.0), flat) == 0.0


@pytest.mark.parametrize(
    ("text", "read"),
    [
        ("max force", Taken("max", "force")),
        ("end der(damper.s rel)", Taken("end", "der(damper.s rel)")),
        ("time x[1] above 20 N", Taken("time", "x[1]", "above", "20 N")),
        ("time a below -0.1 mm", Taken("time", "a", "below", "-0.1 mm")),
    ],
)
def test_texts(text, read):
    assert Taken.read(text) == read


@pytest.mark.parametrize("text", ["", "max", "maximum force", "time force", "force"])
def test_wrong_texts_are_refused(text):
    with pytest.raises(ModelError, match="such as"):
        Taken.read(text)
