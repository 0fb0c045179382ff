"""Forces of the rollers, and the speeds at which harmonics lose their stiffness."""

from __future__ import annotations

import numpy as np
import pytest

import tolstat
from tests.machines.ring_reference import (
    CASES,
    DEG,
    full,
    pulls,
    settings_of,
    states_of,
)
from tests.studies.benchmarks.sigmas import errors
from tolstat.machines.ring import spectrum
from tolstat.machines.ring.motion import cutting_forces, reactions
from tolstat.machines.ring.parameters import parts_of
from tolstat.study.study import load

A = {**CASES["A"], "rtol": 1e-12}
FIG = {
    "radius": 3.0, "thickness": 0.05, "support_angle": 40 * DEG, "ring_damping": 0.0,
}  # fmt: skip


def test_the_rollers_of_case_a_as_computed_elsewhere():
    row = tolstat.evaluate("ring", None, A).iloc[0]
    assert row["roller_1_min"] == pytest.approx(-770.3047, abs=5.1e-5)
    assert row["roller_1_max"] == pytest.approx(712.4627, abs=5.1e-5)
    assert row["roller_2_min"] == pytest.approx(-353.3061, abs=5.1e-5)
    assert row["roller_2_max"] == pytest.approx(773.0133, abs=5.1e-5)
    dead = row["roller_2_max"] / row["roller_lift"]
    assert dead == pytest.approx(47462.97, abs=5.1e-3)
    settings = settings_of(**A)
    _, rings = states_of(settings, [0.0])
    tool, *_ = parts_of(rings, settings.hoop)
    static = cutting_forces(np.array([row["static_depth"]]), rings)
    found = np.squeeze(reactions(0.0, 0.0, *static, tool))
    np.testing.assert_allclose(found, [-54.34946, 183.92116], atol=5.1e-6)


@pytest.mark.parametrize("given", [CASES["F"], {**CASES["B"], "tool_angle": 2.1}])
def test_against_two_multipliers_of_all_coordinates(given):
    settings = settings_of(**{**given, "duration": 0.2, "rtol": 1e-10})
    trajectory = tolstat.trajectory(
        "ring", None, {**given, "duration": 0.2, "rtol": 1e-10}, step=0.02
    )
    times = np.array(trajectory.index)
    states, rings = states_of(settings, times)
    found = trajectory[["roller_1_max", "roller_2_max"]].to_numpy()
    n = settings.harmonics - 1
    s, t = rings.on.s[0], rings.on.t[0]
    for y, own, t_R in zip(states, found, trajectory["depth_min"], strict=True):
        a, b, a_, b_ = y[: 4 * n].reshape(4, n)
        q = np.concatenate([[s @ a], a, [t @ b], b])
        q_ = np.concatenate([[s @ a_], a_, [t @ b_], b_])
        np.testing.assert_allclose(own, pulls(settings, q, q_, t_R), rtol=1e-9)
        assert abs(full(settings).free[5] @ q).max() < 1e-15


def test_the_extremes_are_those_of_the_history():
    given = {**CASES["A"], "duration": 0.3, "rtol": 1e-8}
    row = tolstat.evaluate("ring", None, given).iloc[0]
    frame = tolstat.trajectory("ring", None, given, step=1e-5)
    for i in (1, 2):
        curve = frame[f"roller_{i}_max"]
        assert row[f"roller_{i}_max"] == pytest.approx(curve.max(), rel=1e-5)
        assert row[f"roller_{i}_min"] == pytest.approx(curve.min(), rel=1e-5)


def test_critical_speeds_as_computed_elsewhere():
    frame = tolstat.view("ring", "critical", settings=FIG).frame()
    known = [16.64291, 24.96436, 33.28582, 41.60727, 49.92872]
    np.testing.assert_allclose(frame["speed"], known, atol=5.1e-6)
    growth = [0.0, 7.8706151, 15.3327482, 34.8385922, 61.2208619]
    np.testing.assert_allclose(frame["growth"], growth, atol=5.1e-8)
    assert frame["tension"][0] == pytest.approx(972222.2, abs=0.051)
    assert frame["hoop stress"][0] == pytest.approx(19.44444e6, abs=5.1)
    held = tolstat.view("ring", "critical", settings={**FIG, "hoop": True}).frame()
    assert (held["growth"] == 0.0).all()


def test_flutter_has_no_gap_and_a_real_root_grows_from_4_51():
    root = 16.6429080 / 2
    x = np.arange(2.21, 5.0, 0.01)
    found = spectrum(x * root, FIG)
    assert found.growth.min() > 1e-2 * root
    values = found.eigenvalues
    real = (abs(values.imag) < 1e-9) & (values.real > 1e-6 * root)
    assert x[real.any(axis=1)][0] == pytest.approx(4.51)


def test_the_speed_as_set_is_in_each_picture():
    for name in ("spectrum", "stability"):
        chart = tolstat.view("ring", name, settings=FIG)
        for panel in chart.panels:
            assert panel.spans[-1].words == "speed as set"


@pytest.mark.parametrize("speed", [0.25, 0.5, 1.0, 20.0])
def test_responses_of_the_shipped_study_err_by_a_thousandth_of_their_sigma(speed):
    study = load("runs/ring.toml")
    by_name = errors(study, {"speed": speed}, trials=16).by_name
    assert max(by_name.values()) < 1e-3
