"""Numbers of FMUs, against SciPy with events and against those that others publish."""

from __future__ import annotations

import csv

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import tolstat
from tests.fmu.building import REFERENCE
from tolstat import catalogue

HALF = 1e-4  # of the backlash, m


def two_masses(force, damped_load=2.0):
    """Position of the load and largest force of backlash.h at 0.5 s, by LSODA."""
    m1, m2, k, c = 0.4, 0.9, 8e4, 15.0

    def contact(y):
        d = y[0] - y[2]
        e = d - HALF if d > HALF else d + HALF if d < -HALF else 0.0
        return 0.0 if e == 0.0 else k * e + c * (y[1] - y[3])

    def rates(t, y):
        f = contact(y)
        return [y[1], (force * np.cos(40 * t) - f) / m1, y[3],
                (f - damped_load * y[3]) / m2]  # fmt: skip

    def upper(t, y):
        return y[0] - y[2] - HALF

    def lower(t, y):
        return y[0] - y[2] + HALF

    upper.terminal = lower.terminal = True
    t, y, peak = 0.0, np.zeros(4), 0.0
    while t < 0.5:
        part = solve_ivp(
            rates, (t, 0.5), y, method="DOP853", rtol=1e-12, atol=1e-15,
            events=(upper, lower), max_step=2e-4,
        )  # fmt: skip
        peak = max(peak, *(abs(contact(column)) for column in part.y.T))
        t, y = float(part.t[-1]), part.y[:, -1]
        if t < 0.5:  # leave the event, which is at the start of the next part
            h = 1e-9
            y = y + h * np.array(rates(t, y + 0.5 * h * np.array(rates(t, y))))
            t += h
    return y[2], peak


@pytest.mark.parametrize("fmi", [2, 3])
def test_two_masses_with_backlash(model, fmi):
    model("Backlash", fmi)
    settings = {"model_exchange": True, "rtol": 1e-9, "max_step": 2e-4}
    answers = tolstat.evaluate("Backlash", {"F": [0.0, 3.0]}, settings)
    for (_, row), force in zip(answers.iterrows(), (12.0, 15.0), strict=True):
        position, peak = two_masses(force)
        assert row["position"] == pytest.approx(position, rel=2e-4)
        assert row["peak"] == pytest.approx(peak, rel=2e-3)


@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize("mu", [1.0, 5.0])
def test_van_der_pol(model, fmi, mu):
    model("VanDerPol", fmi)
    exact = solve_ivp(
        lambda t, y: [y[1], mu * (1 - y[0] ** 2) * y[1] - y[0]], (0, 20), [2.0, 0.0],
        method="DOP853", rtol=1e-12, atol=1e-14,
    ).y[0, -1]  # fmt: skip
    common = {"mu": mu}
    both = {"model_exchange": True, "rtol": 1e-9}
    assert end_of("out", {**common, **both}) == pytest.approx(exact, abs=2e-6)
    assert end_of("out", common) == pytest.approx(exact, abs=1e-8)  # RK4 at 1 ms


def end_of(response, settings):
    frame = tolstat.evaluate("VanDerPol", None, settings)
    return frame[response].iloc[0]


@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize(
    ("name", "step"),
    [("BouncingBall", 0.01), ("Dahlquist", 0.1), ("Stair", 0.2), ("VanDerPol", 0.01)],
)
def test_reference_fmus_to_the_last_bit(reference, name, step, fmi):
    with open(REFERENCE / name / f"{name}_out.csv") as file:
        names, *rows = csv.reader(file)
    published = np.array(rows, dtype=np.float64)
    model = catalogue.load(str(reference(name, fmi)))
    settings = {"stop": published[-1, 0], "max_step": step}
    history = tolstat.trajectory(model, None, settings, step=1e-6)
    assert len(history) == len(published)
    for column, values in zip(names[1:], published.T[1:], strict=True):
        assert history[column].tolist() == values.tolist()


def test_dahlquist_by_model_exchange_is_the_exponential(reference):
    """Its co-simulation is Euler's method with 0.1 s, which no caller can shorten."""
    model = catalogue.load(str(reference("Dahlquist")))
    ends = [
        tolstat.evaluate(model, None, {"model_exchange": exchange, "rtol": 1e-9})
        for exchange in (False, True)
    ]
    wrong, right = (frame["x"].iloc[0] for frame in ends)
    assert wrong == pytest.approx(0.9**100)
    assert right == pytest.approx(np.exp(-10.0), abs=1e-8)


def test_responses_count_each_internal_point(model):
    """The peak of the FMU itself, and that of its output, agree by model exchange."""
    loaded = model("VanDerPol")
    responses = {
        "largest": {"taken": "peak out"},
        "kept": {"taken": "end peak"},
        "high": {"taken": "time out above 1"},
        "mean": {"taken": "mean x"},  # a local variable
    }
    settings = {"responses": responses, "rtol": 1e-8, "model_exchange": True}
    row = tolstat.evaluate(loaded, None, settings).iloc[0]
    assert row["largest"] == pytest.approx(row["kept"], rel=1e-5)
    history = tolstat.trajectory(loaded, None, settings, step=1e-9)
    assert history["out"].abs().max() == row["largest"]
    time, out = history.index.to_numpy(), history["out"].to_numpy()
    fine = np.linspace(0, 20, 400_001)
    assert row["high"] == pytest.approx(20 * np.mean(np.interp(fine, time, out) > 1.0),
                                        abs=1e-3)  # fmt: skip
    assert history.attrs["responses"] == dict(row.drop("status"))


def test_deviations_add_to_settings(model):
    loaded = model("Backlash")
    frame = tolstat.evaluate(loaded, {"gap": [0.0]}, {"gap": 2.5e-4})
    assert frame.attrs["units"]["peak"] == "N"
    same = tolstat.evaluate(loaded, {"gap": [5e-5]})
    assert frame["peak"].tolist() == pytest.approx(same["peak"].tolist(), rel=1e-12)
