"""Damping inside the step: its conditions, exactly; stability; order; the same bits."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction as F
from functools import cache

import numpy as np
import pytest
from numba import types
from scipy.integrate import solve_ivp

from tests.integrator.conftest import rubbing, rubbing_rates, step_of
from tolstat.errors import ModelError
from tolstat.integrator import tableau
from tolstat.integrator.integrate import integrate
from tolstat.integrator.problem import Accuracy, System
from tolstat.integrator.signatures import rates_signature, rates_type, step_type, table
from tolstat.integrator.step import advance, error_of
from tolstat.lanes.compiled import compiled
from tolstat.lanes.rows import rows, write
from tolstat.lanes.vector import WIDTH
from tolstat.status import Status

STAGES = range(7)
# the first six stages make the step, the seventh its error estimate
A = [[*row, *[F(0)] * (7 - len(row))] for row in tableau.A]
G = [[*row, *[F(0)] * (7 - len(row))] for row in tableau.G]
for stage in STAGES:
    G[stage][stage] = tableau.G_DIAGONAL
GAMMA = [sum(row, F(0)) for row in G]


def dot(a, b):
    return sum((x * y for x, y in zip(a, b, strict=True)), F(0))


def times(matrix, vector):
    return [dot(row, vector) for row in matrix]


def test_order_conditions_hold_exactly():
    b, b_embedded = tableau.B, tableau.B_EMBEDDED
    assert dot(b, GAMMA) == 0
    assert dot(b, times(A, GAMMA)) == 0
    assert dot(b, times(G, tableau.C)) == 0
    assert dot(b, times(G, GAMMA)) == 0
    assert dot(b_embedded, GAMMA) == 0


def test_the_stiff_limit_is_zero_exactly():
    # (A + G) k = 1 by forward substitution, in the six stages that make the step
    k: list[F] = []
    for i in range(6):
        known = sum((A[i][j] + G[i][j]) * k[j] for j in range(i))
        k.append((1 - known) / G[i][i])
    assert 1 - dot(tableau.B[:6], k) == 0


def stages_of(z):
    """Return U_1 ... U_7, k_1 ... k_7 of a step of u' = z u from 1, h lambda = -z."""
    a, g = np.array(A, float), np.array(G, float)
    stages, k = [], []
    for i in STAGES:
        stages.append(1.0 + sum((a[i, j] * k[j] for j in range(i)), 0.0 * z))
        before = sum((g[i, j] * k[j] for j in range(i)), 0.0 * z)
        k.append((z * stages[i] + z * before) / (1.0 - g[i, i] * z))
    return np.array(stages), np.array(k)


def test_no_stage_exceeds_its_start():
    z = -np.concatenate([[0.0], np.geomspace(1e-6, 1e12, 4001)])
    assert np.abs(stages_of(z)[0]).max() <= 1.0


@pytest.mark.parametrize("degrees", [0, 30, 60, 75, 85, 89])
def test_the_step_shrinks_on_rays(degrees):
    ray = np.exp(1j * np.radians(180 - degrees))
    z = np.geomspace(1e-3, 1e12, 4001) * ray
    assert np.abs(stages_of(z)[0][6]).max() < 1.0


@compiled(types.void(rates_type, table, table, table, step_type, table))
def one_step(rates, h, y, p, step, error):
    step, h = rows(step), rows(h)[0]
    advance(rates, step.moment[0], h, h, rows(y), rows(p), step)
    rows(error)[0] = error_of(h, step.k, 0)


@compiled(rates_signature)
def decay(moment, y, p, out):
    """U' = p[1] - p u, -p[1] from the first mark on, and its lambda."""
    Y, P = rows(y), rows(p)
    push = np.where(rows(moment)[1] > 0.0, -P[1], P[1])
    write(out, 0, (push - P[0] * Y[0], P[0]))


def test_the_compiled_step_is_that_of_the_constants():
    """U' = -lambda u from 1: every stage, the end, the error estimate."""
    z = np.array([0.0, 0.01, 0.3, 1.0, 3.0, 10.0, 1e3, 1e6])
    one = np.ones((1, WIDTH))
    k = np.zeros((7, 3, WIDTH))
    k[0] = -z, z, -z
    end, lambda_h, share, error = np.zeros((4, 1, WIDTH))
    step = step_of(
        moment=np.zeros((2, WIDTH)), k=k, end=end, lambda_h=lambda_h, share=share,
        damped=np.array([0]),
    )  # fmt: skip
    one_step(decay, one, one.copy(), np.stack([z, 0 * z]), step, error)
    stages, expected = stages_of(-z)
    np.testing.assert_allclose(k[:, 0], expected, atol=1e-13, rtol=1e-11)
    np.testing.assert_allclose(step.end[0], stages[6], atol=1e-13)
    estimate = np.array(tableau.E, float) @ expected
    np.testing.assert_allclose(error[0], estimate, atol=1e-13)


@pytest.mark.parametrize("stiffness", [2.0, 50.0, 1e4])
def test_a_rate_that_jumps_at_a_mark(stiffness):
    system = System(decay, np.array([1.0]), damped=(0,))
    marks, push = np.array([[0.0, 0.5, 1.2]]), 3.0
    p = np.array([[stiffness, push]])
    found = integrate(system, np.array([[1.0]]), p, marks, Accuracy(1e-8, 0.1))
    rest, u = push / stiffness, 1.0
    for start, end in ((0.0, 0.5), (0.5, 1.2)):
        u = rest + (u - rest) * np.exp(-stiffness * (end - start))
        assert found.states[0, int(end > 0.5) + 1, 0] == pytest.approx(u, abs=1e-7)
        rest = -rest


def test_between_the_ends_a_damped_state_is_of_order_two(damped_system):
    """And of order four without: what `damping` says of histories."""
    for named, order in ((1.0, 2.0), (0.0, 4.0)):
        p, end = np.array([[2.0, 1.5, named]]), 0.8
        time = np.linspace(0.0, end, 38)
        fine = moved(damped_system, p * [1, 1, 0], Accuracy(1e-12, 0.01), end, time)
        errors = [
            np.abs(moved(damped_system, p, Accuracy(1e9, h), end, time).history
                   - fine.history)[0, :, 1].max()
            for h in (0.04, 0.01)
        ]  # fmt: skip
        assert np.log2(errors[0] / errors[1]) / 2 > order - 0.3


def moved(system, parameters, accuracy, end=4.0, samples=None):
    n = len(parameters)
    start = np.tile([0.4, 0.0], (n, 1))
    marks = np.tile([0.0, end], (n, 1))
    return integrate(system, start, parameters, marks, accuracy, samples=samples)


@cache  # whatever lambda is named
def exact(friction, steepness, end=4.0):
    p = (friction, steepness, 0.0)
    return solve_ivp(
        lambda t, y: rubbing_rates(t, y, p)[:2], (0, end), [0.4, 0.0],
        method="Radau", rtol=1e-12, atol=1e-13,
    ).y[:, -1]  # fmt: skip


@pytest.mark.parametrize(
    ("named", "order"), [(0.0, 5.0), (0.6, 3.0), (1.0, 3.0), (1.5, 3.0)]
)
def test_observed_order(damped_system, named, order):
    """Order 3 with lambda right and wrong, order 5 without; a huge rtol fixes h."""
    p = np.array([[2.0, 1.5, named]])
    end = exact(2.0, 1.5)
    errors = [
        np.abs(moved(damped_system, p, Accuracy(1e9, h)).states[0, 1] - end)
        for h in (0.02, 0.01, 0.005)
    ]
    found = np.log2(np.max(errors[0]) / np.max(errors[2])) / 2
    assert abs(found - order) < 0.35, found


@pytest.mark.parametrize("named", [0.0, -1.0, np.nan, np.inf])
def test_without_lambda_the_same_bits(damped_system, undamped_system, named):
    """None, one that grows, one that is no number: the plain step."""
    p = np.array([[2.0, 1.5, named], [0.3, 20.0, named]])
    damped = moved(damped_system, p, Accuracy(1e-6, 0.1))
    # not through the quadrature, which would be no number either
    plain = moved(undamped_system, np.nan_to_num(p, posinf=0.0), Accuracy(1e-6, 0.1))
    assert np.all(damped.status == Status.DONE)
    np.testing.assert_array_equal(damped.states, plain.states)
    np.testing.assert_array_equal(damped.steps, plain.steps)


def test_friction_that_holds_costs_no_steps(damped_system):
    """The pendulum sticks, slips and sticks again; Radau knows where it ends."""
    stuck = np.array([[0.9, 1e5, 1.0], [0.7, 1e6, 1.0]])
    accuracy = Accuracy(1e-7, 0.05)
    damped = moved(damped_system, stuck, accuracy)
    plain = moved(damped_system, stuck * [1.0, 1.0, 0.0], accuracy)
    ends = np.array([exact(*p[:2]) for p in stuck])
    np.testing.assert_allclose(damped.states[:, 1], ends, atol=2e-7)
    np.testing.assert_allclose(plain.states[:, 1], ends, atol=2e-7)
    assert np.all(plain.steps > 10 * damped.steps), (plain.steps, damped.steps)


def test_lanes_never_mix(damped_system):
    """Damped trials, too, are the same to the last bit among any neighbours."""
    rng = np.random.default_rng(4)
    p = np.stack([rng.uniform(0.2, 1, 30), 10 ** rng.uniform(0, 5, 30), np.ones(30)], 1)
    together = moved(damped_system, p, Accuracy(1e-5, 0.05))
    for i in (0, 7, 29):
        alone = moved(damped_system, p[i : i + 1], Accuracy(1e-5, 0.05))
        np.testing.assert_array_equal(together.states[i], alone.states[0])


@pytest.mark.parametrize("damped", [(2,), (-1,), (0, 0), (0.5,), 1, ("v",)])
def test_damped_numbers_are_states_given_once(damped):
    with pytest.raises(ModelError, match="0 to 1, each once"):
        System(rubbing, np.array([1.0, 1.0]), damped=damped)


@pytest.mark.parametrize(
    ("counts", "words"),
    [
        ({}, "rates fills 3 rows, but 2 are declared .2 states.;"),
        ({"damped": (1,), "n_above": 1}, "4 are declared .2 states, 1 above, 1 damped"),
    ],
)
def test_undeclared_rows_are_refused(counts, words):
    """They would be written beside the stages."""
    system = System(rubbing, np.array([1.0, 1.0]), **counts)
    with pytest.raises(ModelError, match=words):
        moved(system, np.array([[0.3, 20.0, 1.0]]), Accuracy(1e-3, 0.1))


@compiled(rates_signature)
def dragged(moment, y, p, out):
    """A block on a spring and a moving belt, friction 2 arctan(beta u); two powers."""
    t, x, v, beta = rows(moment)[0], rows(y)[0], rows(y)[1], rows(p)[0]
    u = v - 0.3 * np.sin(2.0 * t)
    most = 4.0 / np.pi
    f = most * np.arctan(beta * u)
    slope = most * beta / (1.0 + beta * u * beta * u)
    powers, slopes = (f * u, f * v), (f + u * slope, f + v * slope)
    write(out, 0, ((v, -f - 10.0 * x), powers, slope, slopes))


@compiled(rates_signature)
def dragged_plainly(moment, y, p, out):
    t, x, v, beta = rows(moment)[0], rows(y)[0], rows(y)[1], rows(p)[0]
    u = v - 0.3 * np.sin(2.0 * t)
    f = 4.0 / np.pi * np.arctan(beta * u)
    write(out, 0, ((v, -f - 10.0 * x), (f * u, f * v)))


@compiled(rates_signature)
def dragged_without_slopes(moment, y, p, out):
    t, x, v, beta = rows(moment)[0], rows(y)[0], rows(y)[1], rows(p)[0]
    u = v - 0.3 * np.sin(2.0 * t)
    f = 4.0 / np.pi * np.arctan(beta * u)
    slope = 4.0 / np.pi * beta / (1.0 + beta * u * beta * u)
    write(out, 0, ((v, -f - 10.0 * x), (f * u, f * v), slope))


def test_energies_that_depend_on_a_damped_state():
    """With their slopes they err by tens of rtol, without by hundreds."""
    beta = np.array([[1e3], [1e4]])
    start, marks = np.zeros((2, 2)), np.tile([0.0, 3.0], (2, 1))
    plain = System(dragged_plainly, np.array([0.3, 0.6]), n_quadratures=2)
    damped = replace(plain, rates=dragged_without_slopes, damped=(1,))
    systems = {"slopes": replace(damped, rates=dragged, sloped=(0, 1)), "none": damped}
    exact = integrate(plain, start, beta, marks, Accuracy(1e-9, 0.01))
    total = exact.quadratures[:, -1].max(axis=1)  # J, lost
    worst = dict.fromkeys(systems, 0.0)
    for rtol in (1e-4, 1e-5):
        for name, system in systems.items():
            found = integrate(system, start, beta, marks, Accuracy(rtol, 0.01))
            off = np.abs(found.quadratures - exact.quadratures)[:, -1].max(axis=1)
            worst[name] = max(worst[name], (off / total / rtol).max())
    assert worst["slopes"] < 40
    assert worst["none"] > 300
