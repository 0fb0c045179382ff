"""The elastic machine in studies and views, and the paper's rule."""

from __future__ import annotations

import numpy as np
import pytest

import tolstat
from tests.machines.elastic import CASES, solved
from tolstat.answers.next_steps import with_commands
from tolstat.answers.report.chosen_steps import finer_run
from tolstat.errors import ModelError, StudyError
from tolstat.machines.elastic_machine.frequency_functions import frequency_functions
from tolstat.machines.elastic_machine.modes import modes_of
from tolstat.machines.elastic_machine.start_up import LAWS
from tolstat.model.checked import described
from tolstat.study.study import load

MODEL = "elastic_machine"
STUDY = {"model": MODEL, "trials": 50, "seed": 1}
T_1 = 2 * np.pi / 16.0097389  # of the default chain, s


def study(**settings):
    return {**STUDY, "settings": settings, "deviations": {"stiffness": "+-10 %"}}


LISTS = {
    "inertia": ["2 kg m^2", "1 kg m^2"],
    "stiffness": ["1600 N m/rad", "800 N m/rad"],
    "damping": ["0 N m s/rad", "0 N m s/rad"],
}


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        (
            {**LISTS, "stiffness": ["9 N m/rad"]},
            "stiffness has 1 numbers, inertia has 2",
        ),
        (
            {**LISTS, "damping": ["1 N m s/rad"] * 3},
            "damping has 3 numbers.*0 for none",
        ),
        ({"stiffness": ["900 N m/rad", "-1 N m/rad"]}, "number 2: it must be above 0"),
        ({"inertia": ["0 kg m^2"]}, "number 1: it must be above 0"),
        ({"damping": ["-1 N m s/rad"]}, "number 1: it must be at least 0"),
        ({"inertia": ["1 kg"]}, "inertia"),
        (LISTS, r"load_torque, row 1: mass = 4 does not exist, inertia lists 2 masses"),
        (
            {"load_torque": [{"time": "0 s", "mass": 0, "torque": "1 N m"}]},
            "row 1: mass = 0: it must be at least 1",
        ),
        (
            {"load_torque": [{"time": "-1 s", "mass": 1, "torque": "1 N m"}]},
            "row 1: time = '-1 s': it must be at least 0",
        ),
        (
            {"load_torque": [{"time": "2 s", "mass": 1, "torque": "1 N m"}]},
            "row 1: time = 2 s is not before the horizon of 2 s",
        ),
        ({"start_up_time": "0 s"}, "start_up_time.*above 0"),
        (
            {"start_up_time": "2 s"},
            "start_up_time = 2 s does not end before the horizon",
        ),
        ({"start_up_law": "linear"}, "start_up_law.*constant, polynomial, trapezoidal"),
        ({"final_speed": "10 Hz"}, "final_speed"),
        ({"final_speed": "0 rpm", "load_torque": []}, "nothing moves the machine"),
    ],
)
def test_wrong_chains_are_refused(settings, words):
    with pytest.raises(StudyError, match=words):
        load(study(**settings))


def test_one_mass_is_a_chain():
    one = {name: values[:1] for name, values in LISTS.items()}
    with pytest.raises(StudyError, match=r"does not exist, inertia lists 1 mass;"):
        load(study(**one))
    single = load(study(**one, load_torque=[])).settings
    assert single.inertia == (2.0,) and single.load_torque == ()


def test_contributors_follow_the_chain():
    steps = [
        {"time": "1 s", "mass": 2, "torque": "-1 N m"},
        {"time": "0 s", "mass": 1, "torque": "2 N m"},
    ]
    given = study(**LISTS, load_torque=steps)
    given["deviations"]["load_torque"] = "+-1 N m"
    made = load(given)
    names = [each.name for each in described(made.model, made.settings).contributors]
    assert names == [
        "inertia_1", "inertia_2", "stiffness_1", "stiffness_2", "damping_1",
        "damping_2", "start_up_time", "load_torque_1", "load_torque_2",
    ]  # fmt: skip


def test_a_history_is_the_motion_and_the_trial():
    case = CASES["four masses"]
    given = {**case.settings, "horizon": 2.0, "start_up_law": "trapezoidal"}
    late = {"start_up_time": 0.1}
    moved = tolstat.trajectory(MODEL, late, given, step=1e-3)
    row = tolstat.evaluate(MODEL, late, given).iloc[0]
    found = moved.attrs["responses"]
    assert all(row[name] == value for name, value in found.items())
    known = solved({**given, "start_up_time": 0.6}, moved.index.to_numpy())
    for s in range(4):
        np.testing.assert_allclose(moved[f"error_{s + 1}"], known[:, s], atol=1e-8)
    for name in ("error", "residual", "torque_peak"):
        for s in range(1, 5):
            peak = moved[f"{name}_{s}"].abs().max()
            assert peak == pytest.approx(found[f"{name}_{s}"], rel=1e-3)
    # what is left begins with the end of start-up
    left = moved["residual_4"]
    assert (
        left[left.index < 0.5999].isna().all()
        and left[left.index > 0.6001].notna().all()
    )
    static = -4.0 * (1 / 1200 + 1 / 900 + 1 / 700 + 1 / 500)
    after = moved[moved.index > 0.6001]
    np.testing.assert_allclose(
        after["error_4"] - after["residual_4"], static, rtol=1e-9
    )
    # the programmed speed is reached
    speed = np.trapezoid(moved["acceleration"], moved.index)
    assert speed == pytest.approx(10.0, rel=1e-5)
    assert moved["acceleration"].max() == pytest.approx(1.5 * 10.0 / 0.6)


def test_the_spectrum_shows_law_modes_and_zeros():
    chart = tolstat.view(MODEL, "spectrum")
    curves = {curve.name: curve for curve in chart.curves}
    np.testing.assert_allclose(curves["lambda"].values, np.abs(np.sinc(chart.at)))
    np.testing.assert_array_equal(curves["zeros"].at, np.arange(1.0, 11.0))
    own = np.array([16.0097389, 38.16331999, 55.5078848, 67.56076765]) * 0.5 / 2 / np.pi
    np.testing.assert_allclose(curves["modes"].at, own, rtol=1e-8)
    np.testing.assert_allclose(curves["modes"].values, np.abs(np.sinc(own)), rtol=1e-6)
    smooth = tolstat.view(MODEL, "spectrum", settings={"start_up_law": "polynomial"})
    assert [curve.name for curve in smooth.curves] == ["lambda", "constant", "modes"]


def test_the_residual_over_the_start_up_time():
    """Two masses: zeros of both modes at once; the points are residuals of trials."""
    case = CASES["two masses"]
    given = {**case.settings, "horizon": 3.0}
    chart = tolstat.view(MODEL, "residual", settings=given)
    curves = {curve.name: curve for curve in chart.curves}
    T = 2 * np.pi / np.sqrt(0.5 * 800.0 / 2.0)
    np.testing.assert_allclose(curves["zeros of mode 1"].at, T * np.arange(1, 11))

    def known(t0):
        first, second = (
            np.abs(np.sin(np.pi * t0 / T)),
            np.abs(np.sin(2 * np.pi * t0 / T)),
        )
        return 2 * 12.0 / t0 * (8 / 3 * first + second / 6) * 2.0 / 800.0

    np.testing.assert_allclose(curves["undamped"].values, known(chart.at), rtol=1e-9)
    points = curves["integrated"]
    for t0, value in list(zip(points.at, points.values, strict=True))[::7]:
        lasting = {**given, "start_up_time": t0, "horizon": 13 * T}
        row = tolstat.evaluate(MODEL, None, lasting)
        assert value == pytest.approx(row["residual_2"][0], rel=1e-5, abs=1e-8)
        # both modes meet within the time looked at, or nearly so
        assert 0.9 * known(t0) - 1e-8 <= value <= 1.00001 * known(t0) + 1e-8


def test_the_tolerance_band_holds_the_trials():
    given = {**study(), "deviations": {"stiffness": "+-10 %", "inertia": "+-5 %"}}
    chart = tolstat.view(given, "residual")
    (band,) = chart.bands
    curve = chart.curves[0].values
    inside = (band.lower <= curve) & (curve <= band.upper)
    assert inside.mean() > 0.8 and np.all(band.lower <= band.upper)
    assert chart.marks[0].at == 0.5 and tolstat.view(MODEL, "residual").bands == ()


def test_the_modes_are_listed():
    frame = tolstat.view(MODEL, "modes").frame()
    known = np.array([16.0097389, 38.16331999, 55.5078848, 67.56076765]) / 2 / np.pi
    np.testing.assert_allclose(frame["frequency"], known, rtol=1e-8)
    assert frame["share of static error 4"].sum() == pytest.approx(1.0)
    assert frame["damping ratio"][0] == pytest.approx(0.00800487, abs=5.1e-9)


def test_a_start_up_beyond_the_horizon_is_shown_as_it_is():
    """Only its trial has no answer."""
    late = {"start_up_time": 2.5, "stiffness": 0.21}
    known = tolstat.view(MODEL, "modes").frame()
    found = tolstat.view(MODEL, "modes", late).frame()
    np.testing.assert_allclose(found["frequency"], 1.1 * known["frequency"])
    periods = found["periods in the start-up"]
    np.testing.assert_allclose(periods, 3.0 * found["frequency"])


def test_refusals_of_views():
    with pytest.raises(ModelError, match="cannot be built: cannot exist"):
        tolstat.view(MODEL, "modes", {"inertia_1": -2.0})
    with pytest.raises(ModelError, match="no start-up to leave a vibration"):
        tolstat.view(MODEL, "residual", settings={"final_speed": 0.0})


@pytest.fixture(scope="module")
def started():
    """A thousand machines of each law, started over 5 to 10 periods of mode 1."""
    rng = np.random.default_rng(5)
    parts = [f"{p}_{s}" for p in ("inertia", "stiffness") for s in range(1, 5)]
    deviations = {part: rng.uniform(-0.05, 0.05, 1000) for part in parts}
    deviations["damping"] = rng.uniform(-1.0, 1.0, 1000)  # of all springs alike
    deviations["start_up_time"] = T_1 * rng.uniform(5.0, 10.0, 1000)
    settings = {
        "start_up_time": 1e-3,
        "horizon": 13 * T_1,
        "load_torque": [],
        "rtol": 1e-6,
    }
    return {
        law: tolstat.evaluate(MODEL, deviations, {**settings, "start_up_law": law})
        for law in LAWS
    }


@pytest.mark.parametrize(
    ("law", "greatest"),
    [("polynomial", 1.26), ("trapezoidal", 1.10), ("cycloid", 1.04)],
)
def test_the_papers_rule_holds_for_smooth_start_ups(started, law, greatest):
    rows = started[law]
    assert (rows["status"] == "done").all()
    assert rows["dynamic_factor_4"].max() < greatest
    assert (rows["residual_4"] / rows["error_4"]).max() < 0.2


def test_the_papers_rule_fails_for_the_constant_acceleration(started):
    """However long it lasts: the jump at t = 0 doubles the static error at once."""
    factor = started["constant"]["dynamic_factor_4"]
    assert factor.min() > 1.95 and factor.max() < 2.35


CASE_4 = [np.array(CASES["four masses"].settings[name]) for name in LISTS]


def test_frequency_functions_as_specified():
    """Modulus and degrees at 25 rad/s."""
    e, sigma = (each[0] for each in frequency_functions(*CASE_4, np.array([25.0])))
    for found, size, degrees in (
        (e[3, 3], 1.117421891e-3, -173.5149),
        (e[3, 0], 1.473435907e-3, 179.3290),
        (sigma[3], 4.429790695e-3, -179.5138),
    ):
        assert abs(found) == pytest.approx(size, abs=5.1e-13)
        assert np.degrees(np.angle(found)) == pytest.approx(degrees, abs=5.1e-5)


def test_frequency_functions_are_modal_for_classical_damping_alone():
    """(8) leaves out what couples the modes: 4.32 % of the largest, other dampers."""
    J, c, own = CASE_4
    w = 25.0
    for b, off in ((own, 0.0), (np.array([1.2, 0.0, 3.0, 0.1]), 0.0432)):
        m = modes_of(J, c, b)
        each = 1.0 / (m.gamma - m.alpha * w * w + 1j * w * m.beta)
        modal = np.einsum("ms,mr,m->sr", m.h, m.h, each)
        e = frequency_functions(J, c, b, np.array([w]))[0][0]
        assert abs(modal - e).max() / abs(e).max() == pytest.approx(off, abs=5.1e-5)


@pytest.mark.parametrize("periods", [5, 10])
def test_what_the_first_mode_misses(periods):
    t0 = periods * T_1
    given = {"load_torque": [], "start_up_time": t0, "horizon": 1.1 * t0}
    frame = tolstat.view(MODEL, "first_mode", settings=given).frame()
    known = [0.16974637, 0.07173986, 0.02079194, 0.06718722]
    np.testing.assert_allclose(frame["missed"], known, atol=5.1e-9)
    known = [0.17581757, 0.06122213, -0.02171310, -0.06622705]
    np.testing.assert_allclose(frame["missed statically"], known, atol=5.1e-9)


def test_smooth_starts_miss_the_static_share():
    given = {
        "load_torque": [], "start_up_law": "cycloid", "start_up_time": 60 * T_1,
        "horizon": 61 * T_1,
    }  # fmt: skip
    frame = tolstat.view(MODEL, "first_mode", settings=given).frame()
    known = abs(frame["missed statically"])
    np.testing.assert_allclose(frame["missed"], known, rtol=0.02)


def test_the_response_has_its_peaks_at_the_modes():
    chart = tolstat.view(MODEL, "response")
    e_44 = chart.curves[0].values
    static = sum(1 / c for c in CASE_4[1])
    assert e_44[0] == pytest.approx(static, rel=1e-3)
    tops = 1 + np.flatnonzero((e_44[1:-1] > e_44[:-2]) & (e_44[1:-1] > e_44[2:]))
    modes = tolstat.view(MODEL, "modes").frame()["frequency"]
    np.testing.assert_allclose(chart.at[tops], modes, rtol=0.02)


def test_an_audit_by_runge_kutta_is_named_as_a_study_types_it(tmp_path):
    study = {
        "model": "elastic_machine",
        "trials": 20,
        "seed": 1,
        "deviations": {"stiffness": "+-1 %"},
        "limits": {"error_4": "<= 1 rad"},
    }
    run = tolstat.run(study, output=tmp_path / "r.h5")
    assert run.audited.settings["runge_kutta"] == 1.0
    (finer,) = with_commands(run, [finer_run(run, ["error_4"])])
    assert finer.settings["runge_kutta"] == "true"
    page = tolstat.report(run).html()
    assert (
        "evaluated again with runge_kutta true, rtol 1e-11, max_step 0.0025 s" in page
    )


def test_the_view_of_residuals_brakes_no_chain():
    settings = {"start_up_time": 0.5, "horizon": 3.0}
    braking = {**settings, "braking_time": 0.3, "braking_start": 1.0}
    plain = tolstat.view("elastic_machine", "residual", None, settings).frame()
    other = tolstat.view("elastic_machine", "residual", None, braking).frame()
    assert plain.equals(other)
