"""The elastic machine integrated: against print, closed forms and SciPy."""

from __future__ import annotations

import numpy as np
import pytest

import tolstat
from tests.machines.elastic import CASES, random_machine, solved
from tolstat.lanes.vector import WIDTH
from tolstat.machines.elastic_machine.declarations import Settings
from tolstat.machines.elastic_machine.machine import ElasticMachine
from tolstat.machines.elastic_machine.modes import left_by_start_up, modes_of
from tolstat.machines.elastic_machine.start_up import LAWS
from tolstat.machines.elastic_machine.trials import simulated
from tolstat.model.checked import simulate
from tolstat.model.settings import make

MODEL = "elastic_machine"
TIGHT = {"rtol": 1e-10}


def settings_of(given):
    return make(ElasticMachine(), given)


def theta(given, times, row=None):
    """Histories of theta, float64[time, mass]."""
    settings = settings_of(given)
    n = len(ElasticMachine().describe(settings).contributors)
    row = np.zeros(n) if row is None else row
    found = simulated(row[None], settings, np.asarray(times, float))
    return found.solution.history[0, :, : len(settings.inertia)]


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize(("second", "off"), [(False, 2e-12), (True, 1e-8)])
def test_known_answers(name, second, off):
    """Exact to the digits printed; by Runge-Kutta to 1e-8 of the peak at rtol 1e-10."""
    case = CASES[name]
    times, answers = case.times, case.answers
    given = {**case.settings, "horizon": 2.5, **TIGHT, "runge_kutta": second}
    peak = np.abs(answers).max()
    np.testing.assert_allclose(theta(given, times), answers, atol=off * peak, rtol=0)


def test_the_nominal_machine_is_the_fourth_case():
    case = CASES["four masses"]
    default, given = Settings(), settings_of({**case.settings, "horizon": 2.0})
    assert default == given


def test_the_error_falls_with_the_tolerance():
    case = CASES["four masses"]
    times, answers = case.times, case.answers
    errors = []
    for rtol in (1e-4, 1e-6, 1e-8, 1e-10):
        given = {**case.settings, "horizon": 2.0, "rtol": rtol, "runge_kutta": True}
        found = theta(given, times)
        errors.append(np.abs(found - answers).max())
    assert errors[0] > 9 * errors[1] > 81 * errors[2] > 729 * errors[3]


@pytest.mark.parametrize("law", LAWS)
def test_any_chain_with_any_damping_and_load(law):
    """Damping that is not classical, light and heavy; steps at any time and at once."""
    rng = np.random.default_rng(list(LAWS).index(law) + 20)
    times = np.linspace(0.0, 1.7, 35)
    for _ in range(6):
        machine = random_machine(rng, law)
        known, peaks = solved(machine, times, step=5e-5)
        found = theta({**machine, **TIGHT}, times)
        peak = np.abs(known).max()
        np.testing.assert_allclose(found, known, atol=1e-8 * peak, rtol=0)
        row = tolstat.evaluate(MODEL, None, {**machine, **TIGHT, "max_step": 1e-3})
        n = len(machine["inertia"])
        scale = np.repeat([peak, peak, peaks[2 * n :].max()], n)
        # sampled peaks may miss the top by this much
        np.testing.assert_array_less(
            np.abs(row.iloc[0, : 3 * n].to_numpy(float) - peaks), 1e-6 * scale
        )


def test_start_ups_that_pass_the_steps_of_the_load():
    """Each trial has its own order of events; each is the machine by itself."""
    machine = {
        "inertia": [0.8, 0.5], "stiffness": [900.0, 700.0], "damping": [3.0, 0.2],
        "start_up_law": "trapezoidal", "final_speed": 12.0, "start_up_time": 0.5,
        "load_torque": [
            {"time": 0.6, "mass": 2, "torque": -5.0},
            {"time": 0.3, "mass": 1, "torque": 3.0},
            {"time": 0.5, "mass": 2, "torque": 2.0},
        ],
        "horizon": 1.4,
    }  # fmt: skip
    shifts = [-0.4, -0.2, -0.1, 0.0, 0.05, 0.1, 0.3]
    steps = [0.5, -1.0, 0.25]
    more = {f"load_torque_{i}": step for i, step in enumerate(steps, start=1)}
    accurate = {**machine, **TIGHT, "max_step": 1e-3}
    rows = tolstat.evaluate(MODEL, {"start_up_time": shifts, **more}, accurate)
    for shift, (_, row) in zip(shifts, rows.iterrows(), strict=True):
        alone = {**machine, "start_up_time": 0.5 + shift}
        alone["load_torque"] = [
            {**load, "torque": load["torque"] + more}
            for load, more in zip(machine["load_torque"], steps, strict=True)
        ]
        _, peaks = solved(alone, [], step=5e-5)
        np.testing.assert_allclose(row.iloc[:6].to_numpy(float), peaks, rtol=2e-7)
        exact = tolstat.evaluate(MODEL, None, {**alone, **TIGHT, "max_step": 1e-3})
        # only the scale of its errors differs
        np.testing.assert_allclose(
            exact.iloc[0, :10].to_numpy(float), row.iloc[:10].to_numpy(float), rtol=1e-7
        )


def test_a_step_ends_at_every_jump():
    """Knots of the law too: the trapezoidal jerk has a kink at ninths."""
    load = [
        {"time": 0.3, "mass": 1, "torque": 1.0},
        {"time": 0.0, "mass": 1, "torque": 1.0},
    ]
    settings = settings_of({"start_up_law": "trapezoidal", "load_torque": load})
    shift = np.zeros((2, 15))
    shift[1, 12] = 0.4
    marks = simulated(shift, settings).programme.marks
    knots = np.array([1, 2, 3, 6, 7, 8, 9]) / 9
    for found, t0 in zip(marks, (0.5, 0.9), strict=True):
        known = np.sort([0.0, 0.0, 0.3, *(t0 * knots), 2.0])
        np.testing.assert_allclose(found, known, rtol=1e-15)


def test_the_two_masses_have_the_factor_32_15():
    case = CASES["two masses"]
    row = tolstat.evaluate(MODEL, None, {**case.settings, **TIGHT}).iloc[0]
    unit = 2.0 * 10.0 / 800.0
    assert row["dynamic_factor_2"] == pytest.approx(32 / 15, rel=1e-9)
    assert row["error_2"] == pytest.approx(16 / 3 * unit, rel=1e-9)
    # statically -1.5 J eps0/c for the first mass, peak 8/3
    assert row["dynamic_factor_1"] == pytest.approx(8 / 3 / 1.5, rel=1e-9)
    assert row["frequency_2"] == pytest.approx(2 * row["frequency_1"], rel=1e-12)


def test_a_start_up_of_one_period_leaves_no_residual():
    case = CASES["two masses"]
    T = 2 * np.pi / np.sqrt(0.5 * 800.0 / 2.0)
    lasting = {**case.settings, "start_up_time": T, "horizon": 3 * T, **TIGHT}
    row = tolstat.evaluate(MODEL, None, lasting).iloc[0]
    assert row["residual_2"] < 1e-8 * row["error_2"]
    assert row["residual_1"] < 1e-8 * row["error_1"]
    longer = tolstat.evaluate(MODEL, {"start_up_time": 0.25 * T}, lasting).iloc[0]
    assert longer["residual_2"] > 0.5 * longer["error_2"]


@pytest.mark.parametrize("law", LAWS)
def test_the_residual_is_the_spectrum_at_the_natural_frequency(law):
    """One mass without damping: the amplitude omega0 lambda/k, whatever the law."""
    k, omega0 = 20.0, 6.0
    one = {
        "inertia": [0.5], "stiffness": [200.0], "damping": [0.0], "load_torque": [],
        "start_up_law": law, "final_speed": omega0, "start_up_time": 0.5,
        "horizon": 6.0, "max_step": 1e-3, **TIGHT,
    }  # fmt: skip
    t0 = np.linspace(0.05, 3.0, 23)
    rows = tolstat.evaluate(MODEL, {"start_up_time": t0 - 0.5}, one)
    known = omega0 / k * LAWS[law].spectrum(k * t0 / (2 * np.pi))
    np.testing.assert_allclose(rows["residual_1"], known, atol=2e-8)
    modes = modes_of(np.array([0.5]), np.array([200.0]), np.zeros(1))
    left = left_by_start_up(modes, LAWS[law], omega0, t0)[:, 0, 0]
    np.testing.assert_allclose(left, known, rtol=1e-12)


def test_the_residual_is_about_the_loaded_equilibrium():
    """Heavily damped and started long ago: only the step of the load is left."""
    given = {
        "inertia": [0.5], "stiffness": [2000.0], "damping": [40.0],
        "start_up_time": 0.4, "horizon": 2.0, "final_speed": 10.0,
        "load_torque": [{"time": 1.0, "mass": 1, "torque": -30.0}], **TIGHT,
    }  # fmt: skip
    row = tolstat.evaluate(MODEL, None, given).iloc[0]
    # in the moment of the step the mass is off its new rest by all of it
    assert row["residual_1"] == pytest.approx(30.0 / 2000.0, rel=1e-9)


def test_the_load_counts_in_the_factor_until_the_end_of_start_up():
    """M_end of the dynamic factor: what steps at t0 counts, what steps later not."""
    one = {"inertia": [0.5], "stiffness": [2000.0], "damping": [4.0], "horizon": 2.0}
    for time, counts in ((0.0, 1.0), (0.5, 1.0), (0.5000001, 0.0)):
        load = [{"time": time, "mass": 1, "torque": -10.0}]
        row = tolstat.evaluate(MODEL, None, {**one, "load_torque": load}).iloc[0]
        static = (0.5 * 20.0 + counts * 10.0) / 2000.0
        assert row["dynamic_factor_1"] == pytest.approx(row["error_1"] / static)
    smooth = {**one, "load_torque": [], "start_up_law": "polynomial"}
    row = tolstat.evaluate(MODEL, None, smooth).iloc[0]
    static = 0.5 * 20.0 * 16 / 9 / 2000.0
    assert row["dynamic_factor_1"] == pytest.approx(row["error_1"] / static)


def test_deviations_change_the_declared_quantity():
    """Relative but for time and torque; the final speed is held."""
    rng = np.random.default_rng(3)
    settings = Settings()
    names = [c.name for c in ElasticMachine().describe(settings).contributors]
    assert names[:5] == [
        "inertia_1",
        "inertia_2",
        "inertia_3",
        "inertia_4",
        "stiffness_1",
    ]
    assert names[12:] == ["start_up_time", "load_torque_1"]
    deviations = dict(zip(names, rng.uniform(-0.2, 0.2, len(names)), strict=True))
    row = tolstat.evaluate(MODEL, deviations).iloc[0]
    given = {
        part: [
            value * (1 + deviations[f"{part}_{s}"])
            for s, value in enumerate(getattr(settings, part), start=1)
        ]
        for part in ("inertia", "stiffness", "damping")
    }
    given["start_up_time"] = 0.5 + deviations["start_up_time"]
    torque = -4.0 + deviations["load_torque_1"]
    given["load_torque"] = [{"time": 0.1, "mass": 4, "torque": torque}]
    known = tolstat.evaluate(MODEL, None, given).iloc[0]
    responses = [r.name for r in ElasticMachine().describe(settings).responses]
    np.testing.assert_allclose(
        row[responses].to_numpy(float), known[responses].to_numpy(float), rtol=1e-6
    )


@pytest.mark.parametrize("law", LAWS)
def test_bit_for_bit_the_same_in_any_block(law):
    settings = settings_of({"start_up_law": law, "rtol": 1e-6})
    rng = np.random.default_rng(6)
    n = len(ElasticMachine().describe(settings).contributors)
    deviations = rng.uniform(-0.3, 0.3, (3 * WIDTH + 5, n))
    deviations[4, 0] = -1.5  # cannot exist
    machine = ElasticMachine()
    whole = simulate(machine, deviations, settings)
    for rows in (slice(0, 1), slice(3, 8), slice(17, None), slice(None, None, -1)):
        part = simulate(machine, deviations[rows], settings)
        np.testing.assert_array_equal(part.responses, whole.responses[rows])
        np.testing.assert_array_equal(part.status, whole.status[rows])
        np.testing.assert_array_equal(part.steps, whole.steps[rows])


def test_trials_without_responses_have_a_reason():
    rows = tolstat.evaluate(
        MODEL,
        {
            "inertia_2": [0, -1, 0, 0, 0, 0, 0, 0, 0],
            "stiffness_1": [0, 0, -1.2, 0, 0, 0, 0, 0, 0],
            "damping_3": [0, 0, 0, -1.01, 0, 0, -1.0, 0, 0],
            "start_up_time": [0, 0, 0, 0, -0.5, 1.5, 0, 1.4999, 1.6],
        },
    )
    impossible, late = "cannot exist", "still starting at the horizon"
    assert list(rows["status"]) == [
        "done", impossible, impossible, impossible, impossible, late, "done", "done",
        late,
    ]  # fmt: skip
    failed = rows["status"] != "done"
    assert rows.loc[failed, "error_1"].isna().all()
    assert rows.loc[failed, "steps"].max() < 100


def test_a_machine_held_by_its_load_has_no_factor():
    """The load carries the mass along, or comes later: nothing to refer the peak to."""
    one = {
        "inertia": [0.5], "stiffness": [2000.0], "damping": [4.0],
        "load_torque": [{"time": 0.0, "mass": 1, "torque": 10.0}],
    }  # fmt: skip
    rows = tolstat.evaluate(MODEL, {"load_torque_1": [0.0, 1.0]}, one)
    assert list(rows["status"]) == ["done", "done"]
    assert rows["error_1"].iloc[1] > 0.0
    assert "dynamic_factor_1" not in rows
    one["load_torque"][0]["torque"] = 9.0
    rows = tolstat.evaluate(MODEL, {"load_torque_1": [0.0, 1.0]}, one)
    assert list(rows["status"]) == ["done", "no static error"]
    stands = {
        "final_speed": 0.0, "load_torque": [{"time": 1.0, "mass": 4, "torque": -4.0}]
    }  # fmt: skip
    row = tolstat.evaluate(MODEL, None, stands).iloc[0]
    assert row["status"] == "done"
    # a step doubles the static deflection at most
    assert 1.0 < row["error_4"] / (4 / 1200 + 4 / 900 + 4 / 700 + 4 / 500) < 2.0
    assert not any(name.startswith("dynamic_factor") for name in row.index)


def test_the_force_in_a_stiff_spring_behind_a_soft_one():
    """Its twist is a millionth of the deflections, its torque is right all the same."""
    two = {
        "inertia": [0.8, 0.6], "stiffness": [1200.0, 1e8], "damping": [0.0, 0.0],
        "load_torque": [], "rtol": 1e-7,
    }  # fmt: skip
    row = tolstat.evaluate(MODEL, None, two).iloc[0]
    # as one mass: twice the static torque, and what the fast mode adds
    assert row["torque_peak_2"] == pytest.approx(24.0, rel=1e-5)


def test_many_masses():
    """Ninety masses: a wave runs along the chain and back."""
    n, k = 90, np.sqrt(1e4 / 0.1)
    given = {
        "inertia": [0.1] * n, "stiffness": [1e4] * n, "damping": [0.0] * n,
        "load_torque": [{"time": 0.0, "mass": n, "torque": 1.0}], "final_speed": 0.0,
        "start_up_time": 0.05, "horizon": 0.9 * n / k,
    }  # fmt: skip
    row = tolstat.evaluate(MODEL, None, given).iloc[0]
    # it has not come to the first mass
    assert row["error_1"] < 1e-3 * row[f"error_{n}"]
    m = np.arange(1, n + 1)
    known = 2 * k * np.sin((2 * m - 1) * np.pi / (4 * n + 2)) / (2 * np.pi)
    found = row[[f"frequency_{i}" for i in m]].to_numpy(float)
    np.testing.assert_allclose(found, known, rtol=1e-10)


BRAKED = {"load_torque": [], "braking_start": 1.0, "braking_time": 0.3}
ROWS = [(0, 0), (0.1, 30), (0.3, 30), (0.35, 0), (0.6, 0), (0.6, -20), (0.9, -10)]
TABLE = {
    "start_up_law": "table", "load_torque": [],
    "acceleration": [{"time": t, "acceleration": a} for t, a in ROWS],
}  # fmt: skip


@pytest.mark.parametrize("second", [False, True])
@pytest.mark.parametrize(
    ("given", "printed"),
    [
        (BRAKED, "1.05 7.9706518e-2 1.3 3.1146463e-2 1.4 -.232537389 2 .225571325"),
        (TABLE, ".05 -6.24966009e-3 .2 -.264109974 .7 -.134045982 1.2 .198714670"),
    ],
)
def test_braking_and_a_table_as_specified(given, printed, second):
    """Theta of the last mass, to the digits of the reference."""
    times, answers = np.array(printed.split(), float).reshape(-1, 2).T
    own = {**given, "runge_kutta": second, "rtol": 1e-11, "max_step": 1e-3}
    found = theta(own, times)[:, 3]
    digit = 10.0 ** (np.floor(np.log10(abs(answers))) - 8)
    digit[abs(answers) < 0.1] *= 10 if given is BRAKED else 1
    assert (abs(found - answers) < 0.51 * digit + 1e-11).all()


def test_starting_and_braking_alike_cancel_or_double():
    """Undamped, one mass: whole periods between leave nothing, half more the double."""
    T = 2 * np.pi / 20.0
    one = {
        "inertia": [0.5], "stiffness": [200.0], "damping": [0.0], "load_torque": [],
        "start_up_time": 0.4 * T, "braking_time": 0.4 * T, "horizon": 9 * T,
    }  # fmt: skip
    row = tolstat.evaluate(MODEL, None, {**one, "braking_start": 3.0 * T}).iloc[0]
    assert row["residual_1"] < 1e-12 * row["error_1"]
    row = tolstat.evaluate(MODEL, None, {**one, "braking_start": 3.5 * T}).iloc[0]
    alone = {**one, "braking_time": 0.0}
    single = tolstat.evaluate(MODEL, None, alone).iloc[0]["residual_1"]
    assert row["residual_1"] == pytest.approx(2 * single, rel=1e-11)


@pytest.mark.parametrize(("periods", "stiffer"), [(5, 1), (10, 1), (5, 4), (10, 4)])
def test_the_peak_is_the_speed_over_time_and_stiffness(periods, stiffer):
    """|theta_4| t0 k_1^2/omega0 after (19): the same for any t0, and c x 4, b x 2."""
    own = Settings()
    k_1 = modes_of(*(np.array(x) for x in (own.inertia, own.stiffness, own.damping))).k
    k_1 = k_1[0] * np.sqrt(stiffer)
    t0 = periods * 2 * np.pi / k_1
    given = {
        "stiffness": [stiffer * c for c in own.stiffness], "load_torque": [],
        "damping": [np.sqrt(stiffer) * b for b in own.damping],
        "start_up_time": t0, "horizon": 1.1 * t0,
    }  # fmt: skip
    row = tolstat.evaluate(MODEL, None, given).iloc[0]
    assert row["error_4"] * t0 * k_1**2 / 10.0 == pytest.approx(2.7410123, abs=5.1e-8)


@pytest.mark.parametrize("law", LAWS)
def test_the_two_methods_agree_on_braking_by_any_law(law):
    """Loads in the middle of everything, deviating times: two methods, one motion."""
    given = {
        "start_up_law": law, "braking_start": 0.9, "braking_time": 0.4, "horizon": 1.8,
        "load_torque": [
            {"time": t, "mass": 1 + i, "torque": 3.0 - i}
            for i, t in enumerate((0.2, 0.9, 1.1, 1.5))
        ],
        **TIGHT, "max_step": 1e-3,
    }  # fmt: skip
    deviations = {"start_up_time": [0.0, -0.1, 0.3], "braking_time": [0.0, 0.2, -0.1]}
    rows = [
        tolstat.evaluate(MODEL, deviations, {**given, "runge_kutta": second})
        for second in (False, True)
    ]
    exact, stepped = (row.iloc[:, :-2].to_numpy(float) for row in rows)
    np.testing.assert_allclose(exact, stepped, rtol=3e-8)


def test_a_motion_that_is_cut_off_has_no_answer():
    deviations = {"start_up_time": [0.0, 0.6, 0.0], "braking_time": [0.0, 0.0, 0.8]}
    rows = tolstat.evaluate(MODEL, deviations, BRAKED)
    late = "still starting at the horizon"
    assert list(rows["status"]) == ["done", late, late]


@pytest.mark.parametrize(
    ("given", "printed"),
    [
        (BRAKED, [0.239460729, 0.014242003, 0.003297388, 0.000474228]),
        (TABLE, [0.315112360, 0.012845101, 0.000893787, 0.000195195]),
    ],
)
def test_what_each_mode_keeps_after_the_motion(given, printed):
    frame = tolstat.view(MODEL, "modes", settings=given).frame()
    np.testing.assert_allclose(frame["residual 4"], printed, atol=5.1e-10)


@pytest.mark.parametrize("law", LAWS)
def test_what_one_mass_keeps_is_what_it_swings_by(law):
    """The residual's envelope, from theta and its rate at the end of the motion."""
    one = {
        "inertia": [0.5], "stiffness": [200.0], "damping": [1.5], "load_torque": [],
        "start_up_law": law, "braking_start": 0.7, "braking_time": 0.6, "horizon": 1.6,
    }  # fmt: skip
    k, zeta = 20.0, 1.5 * 20.0 / 400.0
    k_d = k * np.sqrt(1 - zeta**2)
    t = np.array([0.0, np.pi / 2 / k_d])
    now, later = theta(one, 1.3 + t)[:, 0] * np.exp(zeta * k * t)
    frame = tolstat.view(MODEL, "modes", settings=one).frame()
    assert frame["residual 1"][0] == pytest.approx(np.hypot(now, later), rel=1e-10)
