"""The stand's equations: NumPy against compiled, invariants, histories, parameters."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import dblquad
from scipy.optimize import minimize

from tests.deviations.drawing import draw
from tolstat.lanes.vector import WIDTH
from tolstat.machines.stand import parameters
from tolstat.machines.stand.declarations import (
    END,
    NAMES,
    RESPONSES,
    WINDOW,
    Settings,
    description_of,
)
from tolstat.machines.stand.machine import (
    Stand,
    marks_of,
    moved,
    responses_of,
    simulated,
)
from tolstat.machines.stand.motion import Loads, Powers, State, motion
from tolstat.machines.stand.parameters import Parts, friction_arm, gear_deformations
from tolstat.model.checked import simulate
from tolstat.moving import Moment
from tolstat.status import words_of
from tolstat.study.study import load

NOMINAL = Settings()


def machines(trials, **settings):
    """Draw machines as runs/khpt75.toml does."""
    study = load("runs/khpt75.toml")
    table = draw(
        NAMES, study.deviating.distributions, sampling="random", seed=75, trials=trials
    )
    chosen = Settings(**settings)
    return table, parameters.build(table, chosen), chosen


def random_states(p, rng):
    """States near the rigid motion, with elastic deflections and speeds."""
    n = len(p.m)
    phi = rng.uniform(-1, 26, n)
    f = phi + np.arcsin(p.sin_psi1)
    h = NOMINAL.h - p.r_1 * np.sin(f)
    x = np.sqrt(p.l1**2 - h**2) - p.r_1 * np.cos(f)
    return State(
        phi + rng.normal(0, 3e-4, n), phi + rng.normal(0, 3e-4, n),
        x + rng.normal(0, 3e-4, n), rng.normal(0, 1e-3, n), rng.normal(7, 2, n),
        rng.normal(7, 2, n), rng.normal(0, 2, n), rng.normal(0, 1e-2, n),
    )  # fmt: skip


def scales(p, y):
    """Sizes of the terms that cancel in each output: what rounding is relative to."""
    N = NOMINAL
    angle = np.abs(y.phi31) + 1
    mesh, rod = N.k3 * N.r3 * angle, N.k * N.l
    shaft9, shaft12 = N.c3 * angle, N.c2 * N.r3 / N.r2 * angle
    wheel = (mesh * N.r3 + rod * N.r + shaft9) / N.I
    derivative = [
        10, 10, 3, 1, wheel, wheel, rod / N.m, (rod + N.c_s) / N.I_s,
    ]  # fmt: skip
    speed = 20.0
    powers = [mesh * N.r1 * speed] + [(rod + mesh) * speed] * 6
    loads = [rod, rod, shaft9, shaft12, mesh, mesh, mesh, mesh * N.r1, 1]
    return np.stack(np.broadcast_arrays(*derivative, *powers, *loads, 1.0, 1.0, rod))


@pytest.mark.parametrize("variant", ["indeterminate", "equalized"])
@pytest.mark.parametrize("drive", ["direct", "balanced"])
def test_compiled_equations_are_the_numpy_ones(variant, drive):
    from tolstat.machines.stand.compiled import SYSTEM

    rng = np.random.default_rng(7)
    _, p, _ = machines(25 * WIDTH, variant=variant, drive=drive)
    y = random_states(p, rng)
    moment = Moment(rng.uniform(0, 3.5, len(p.m)), np.zeros(len(p.m)))
    at = motion(moment, y, p)
    expected = np.stack(
        [*at.derivative, *at.powers, *at.loads, *at.jam, *at.turns, *at.relaxation]
    )
    found = np.empty_like(expected)
    watched = np.empty((len(at.loads) + 2, len(p.m)))
    for first in range(0, len(p.m), WIDTH):
        lanes = slice(first, first + WIDTH)
        block = [
            np.ascontiguousarray(np.stack(each)[:, lanes]) for each in (moment, y, p)
        ]
        out, loads = np.empty((len(expected), WIDTH)), np.empty((len(watched), WIDTH))
        SYSTEM.rates(*block, out)
        SYSTEM.watch(*block, loads)
        found[:, lanes], watched[:, lanes] = out, loads
    assert np.all(np.isfinite(expected))
    off = np.abs(found - expected) / scales(p, y)
    assert off.max() < 1e-12, off.max(axis=1)
    loads = found[-1 - len(watched) : -1]
    np.testing.assert_allclose(watched, loads, rtol=1e-12, atol=1e-6)


def test_the_yaw_relaxes_at_the_rate_of_the_equations():
    """The relaxation is -d(alpha'')/d(alpha'), but for what the rods' dampers add."""
    rng = np.random.default_rng(10)
    _, p, _ = machines(400)
    y = random_states(p, rng)
    # from where friction holds to where it slips, inside the guides and at them
    y = y._replace(alpha_=rng.choice([-1, 1], 400) * 10 ** rng.uniform(-9, -2, 400))
    moment = Moment(np.full(400, 2.0), np.zeros(400))
    eps = 1e-4 * np.maximum(np.abs(y.alpha_), 1e-6)

    def turned(sign):
        moved = y._replace(alpha_=y.alpha_ + sign * eps)
        return motion(moment, moved, p).derivative.alpha_

    numeric = -(turned(1) - turned(-1)) / (2 * eps)
    (damping,) = motion(moment, y, p).relaxation
    assert damping.max() > 1e4
    N = NOMINAL
    rods = np.max(p.H1 + p.H2) * (N.dl_s / 2) ** 2 / N.I_s
    assert np.all(np.abs(numeric - damping) < 1e-3 * np.abs(damping) + 2 * rods)
    equalized = machines(400, variant="equalized")[1]
    assert np.all(motion(moment, y, equalized).relaxation[0] == 0)


def test_power_of_every_force_adds_up_to_the_stored_energy():
    """d(stored)/dt = drive - losses at any state: every force is in its power."""
    rng = np.random.default_rng(8)
    _, p, _ = machines(200)
    y = random_states(p, rng)
    t = rng.uniform(0.05, 3.5, len(p.m))
    zero = np.zeros_like(t)
    at = motion(Moment(t, zero), y, p)
    eps = 1e-7

    def stored(sign):
        moved = State(
            *(a + sign * eps * b for a, b in zip(y, at.derivative, strict=True))
        )
        return motion(Moment(t + sign * eps, zero), moved, p).stored

    rate = (stored(1) - stored(-1)) / (2 * eps)
    balance = at.powers.drive - sum(at.powers[1:])
    size = np.abs(np.stack(at.powers)).sum(axis=0)
    assert np.median(np.abs(rate - balance) / size) < 1e-6
    np.testing.assert_allclose(rate, balance, atol=1e-3 * size.max())


def test_losses_are_losses():
    rng = np.random.default_rng(9)
    _, p, _ = machines(500)
    powers = motion(
        Moment(np.full(500, 2.0), np.zeros(500)), random_states(p, rng), p
    ).powers
    # slide and spin need pressure on the feet, which such wild states lift; the smooth
    # rolling force pulls a little on the way back
    for name in ("guide", "damping"):
        assert np.all(getattr(powers, name) >= 0), name


def test_histories_give_the_same_shares_peaks_and_energies():
    """By other means: states by dense output, equations in NumPy, sums by rule."""
    table = np.zeros((3, len(NAMES)))
    table[:, NAMES.index("crank_difference")] = 1e-3, 2e-3, 3e-3
    settings = Settings(contact_yaw=5.8e-4, rtol=1e-8, max_step=1e-4)
    p = parameters.build(table, settings)
    marks = marks_of(settings)
    t = np.linspace(marks[WINDOW], marks[END], 60_001)
    found = simulated(p, settings, t)
    told = responses_of(found, p, settings)
    for i in range(3):
        one = parameters.Parameters(*(np.full(len(t), each[i]) for each in p))
        at = moved(t, 0 * t, found.history[i], one)
        assert told["jam_share"][i] == pytest.approx(np.mean(at.jam[0] > 0), abs=2e-4)
        for power in Powers._fields:
            energy = np.trapezoid(getattr(at.powers, power), t)
            size = told["drive_energy"][i]
            assert told[f"{power}_energy"][i] == pytest.approx(energy, abs=2e-5 * size)
        for name in Loads._fields:
            load = getattr(at.loads, name)
            assert told[name][i] == pytest.approx(np.abs(load).max(), rel=1e-5)
        pull = at.loads.rod_force_2
        assert told["rod_tension_2"][i] == pytest.approx(pull.max(), rel=1e-5)
        assert told["rod_compression_2"][i] == pytest.approx(-pull.min(), rel=1e-5)


def test_the_paper_sees_opposite_rod_forces():
    """Dr = 1 mm: the rod forces are of opposite sign during 2.05 % of the window."""
    settings = Settings(rtol=1e-7, max_step=2e-4)
    table = np.zeros((1, len(NAMES)))
    table[0, NAMES.index("crank_difference")] = 1e-3
    p = parameters.build(table, settings)
    marks = marks_of(settings)
    t = np.linspace(marks[WINDOW], marks[END], 40_001)
    found = simulated(p, settings, t)
    one = parameters.Parameters(*(np.full(len(t), each[0]) for each in p))
    loads = moved(t, 0 * t, found.history[0], one).loads
    opposite = np.mean(loads.rod_force_1 * loads.rod_force_2 < 0)
    assert opposite == pytest.approx(0.0205, abs=2e-4)


def test_friction_arm_of_equation_8():
    a, b = NOMINAL.dl_s / 2 - NOMINAL.foot, NOMINAL.dl_s / 2
    integral, _ = dblquad(np.hypot, 0, NOMINAL.dh / 2, a, b)
    arm = friction_arm(NOMINAL.dh, NOMINAL.dl_s, NOMINAL.foot)
    assert arm == pytest.approx(4 * integral / 0.3, rel=1e-10)
    assert NOMINAL.mu * arm == pytest.approx(0.0279986, rel=2e-6)


@pytest.mark.parametrize("balanced", [False, True])
def test_pinions_take_the_turn_of_least_energy(balanced):
    k = np.array([3.3e9]), np.array([3.5e9]), np.array([3.1e9])
    c2 = np.array([0.0 if balanced else 8.6e6])
    parts = Parts(*np.ones((len(Parts._fields), 1)))
    parts = parts._replace(k30=k[0], k31=k[1], k32=k[2], c2=c2)
    drive = "balanced" if balanced else "direct"
    B = gear_deformations(parts, Settings(drive=drive))[0]
    turned = np.array([1e-3, 0.4e-3, 0.35e-3])
    stiffness = np.array([*k, c2])[:, 0]
    N = NOMINAL

    def energy(pinions):
        one, two = 1e-3 * pinions
        first = 0.5 * (one + two) if balanced else one
        deformations = np.array([
            turned[0] * N.r1 + first * N.r2, turned[1] * N.r3 + one * N.r2,
            turned[2] * N.r3 + two * N.r2, two - one,
        ])  # fmt: skip
        return float(0.5 * stiffness @ deformations**2)

    least = minimize(energy, [-1.0, -1.0], method="BFGS", options={"gtol": 1e-8}).fun
    assert 0.5 * stiffness @ (B @ turned) ** 2 == pytest.approx(least, rel=1e-6)


def test_the_pair_is_the_sum_of_its_single_parts():
    model = Stand()

    def of(**deviations):
        row = np.array([[deviations.get(name, 0.0) for name in NAMES]])
        return model.evaluate(row, Settings()).responses[0]

    pair = of(crank_difference=8e-4, rod_difference=3e-4)
    parts = of(
        crank_radius_1=-4e-4, crank_radius_2=4e-4, rod_length_1=3e-4, rod_length_2=-3e-4
    )
    np.testing.assert_allclose(pair, parts, rtol=1e-6, atol=1e-9)


def test_an_impossible_trial_does_not_change_its_neighbours():
    model = Stand()
    table = np.zeros((4, len(NAMES)))
    table[1, NAMES.index("rod_stiffness_1")] = -1.5
    table[2, NAMES.index("rod_length_2")] = -2.2
    responses, status, *_ = simulate(model, table, Settings())
    words = [words_of(model.failures)[code] for code in status]
    assert words == ["done", "no part left", "rod too short", "done"]
    assert np.all(np.isnan(responses[1:3]))
    np.testing.assert_array_equal(responses[0], responses[3])


def test_guide_clearance_has_no_effect_when_the_contact_is_given():
    table = np.zeros((2, len(NAMES)))
    table[:, NAMES.index("crank_difference")] = 1e-3
    table[1, NAMES.index("guide_clearance")] = 1e-3
    given = Stand().evaluate(table, Settings(contact_yaw=5.8e-4)).responses
    np.testing.assert_array_equal(given[0], given[1])
    table[:, NAMES.index("crank_difference")] = 3e-3
    free = Stand().evaluate(table, Settings()).responses
    assert free[0, 0] > free[1, 0]


def test_declarations_are_complete():
    description = description_of(Settings())
    for each in (*description.contributors, *description.responses):
        assert each.unit and each.symbol and each.sentence and each.source
    assert len(set(NAMES)) == len(NAMES) == 46
    assert len(RESPONSES) == 30
    assert set(Loads._fields) >= {"yaw", "drive_moment"}


def test_no_trial_jams_longer_than_its_duration():
    """Times summed step by step pass the window by 1e-13: a limit of 100 % counted."""
    rows = [129, 256, 419, 730, 962]
    table, _, settings = machines(max(rows) + 1)
    jammed = Stand().evaluate(table[rows], settings).responses
    share = jammed[:, [each.name for each in RESPONSES].index("jam_share")]
    assert share.max() <= 1 and share.min() > 1 - 1e-9
    _, p, settings = machines(1)
    found = simulated(p, settings)
    window = marks_of(settings)[END] - marks_of(settings)[WINDOW]
    for above, known in ((window * (1 + 1e-13), 1.0), (np.nan, np.nan)):
        changed = found._replace(above=np.full_like(found.above, above))
        np.testing.assert_array_equal(
            responses_of(changed, p, settings)["jam_share"], known
        )
