"""What an examination says of equations whose answer is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.conftest import ROOT
from tolstat.execution.diagnostics.kinks import kinks_of, surveyed
from tolstat.integrator.examination import examine
from tolstat.integrator.integrate import observed
from tolstat.integrator.residual import largest_residual
from tolstat.moving import (
    Accuracy,
    System,
    compiled,
    integrate,
    proposed_scale,
    rates_signature,
    rows,
    write,
)
from tolstat.study.study import load

ENDS = np.array([[0.0, 2.0]])


@compiled(rates_signature)
def pursuit(moment, y, p, out):
    """The first state chases the cosine of time, p[0] times a second; lambda last."""
    t, state, rate = rows(moment)[0], rows(y), rows(p)[0]
    speed = rate * (np.cos(t) - state[0])
    write(out, 0, (speed, state[0], rate))


@compiled(rates_signature)
def explosion(moment, y, p, out):
    """The speed v' = v^3 is infinite at t = 1/2."""
    x, v = rows(y)[0], rows(y)[1]
    write(out, 0, (v, v * v * v, x))


@compiled(rates_signature)
def swing(moment, y, p, out):
    """One state swings a hundred times as fast as the other pair."""
    s = rows(y)
    write(out, 0, (s[1], -s[0], s[3], -1e4 * s[2]))


@compiled(rates_signature)
def van_der_pol(moment, y, p, out):
    x, v, mu = rows(y)[0], rows(y)[1], rows(p)[0]
    write(out, 0, (v, mu * (1.0 - x * x) * v - x))


@compiled(rates_signature)
def lorenz(moment, y, p, out):
    x, y, z = rows(y)[0], rows(y)[1], rows(y)[2]
    write(out, 0, (10.0 * (y - x), x * (28.0 - z) - y, x * y - 8.0 / 3.0 * z))


@compiled(rates_signature)
def hanging(moment, y, p, out):
    write(out, 0, (rows(y)[1], -np.sin(rows(y)[0])))


@compiled(rates_signature)
def kepler(moment, y, p, out):
    x, y, u, v = rows(y)[0], rows(y)[1], rows(y)[2], rows(y)[3]
    r = np.sqrt(x * x + y * y)
    write(out, 0, (u, v, -x / (r * r * r), -y / (r * r * r)))


@compiled(rates_signature)
def pushed(moment, y, p, out):
    """A push for p[0] from t = 1 on, of area 1."""
    t, width = rows(moment)[0], rows(p)[0]
    on = (t > 1.0) & (t < 1.0 + width)
    write(out, 0, (np.where(on, 1.0 / width, 0.0),))


@compiled(rates_signature)
def pushed_follower(moment, y, p, out):
    """The push moves the first state; the second one relaxes to it at 1e4 1/s."""
    t, width, s = rows(moment)[0], rows(p)[0], rows(y)
    on = (t > 1.0) & (t < 1.0 + width)
    push = np.where(on, 1.0 / width, 0.0)
    write(out, 0, (push - 0.1 * s[1], 1e4 * (s[0] - s[1]), 1e4))


def integrated(system, start, parameters, accuracy, end=2.0):
    ends = np.array([[0.0, end]])
    with observed() as seen:
        integrate(system, np.array([start]), np.array([parameters]), ends, accuracy)
    return seen[0]


CHASE = System(pursuit, np.array([1.0, 1.0]), n_above=1)
DAMPED = System(pursuit, np.array([1.0, 1.0]), damped=(0,))


def test_stability_limits_a_stiff_equation_and_accuracy_another():
    start, accuracy = [1.0, 0.0], Accuracy(1e-3, 2.0)
    stiff = examine(integrated(CHASE, start, [1e4], accuracy))
    assert stiff.stiff and stiff.demanding == 0 and stiff.undamped is None
    # the limit of the method on the real axis is 3.3
    assert stiff.steps[0] == pytest.approx(1e4 * 2.0 / 3.3, rel=0.15)
    soft = examine(integrated(CHASE, start, [1.0], Accuracy(1e-8, 2.0)))
    assert not soft.stiff and not soft.by_longest and soft.looser < 0.6


def test_damping_pays_where_an_equation_is_stiff():
    start = [1.0, 0.0]
    assert examine(integrated(DAMPED, start, [1e4], Accuracy(1e-3, 2.0))).undamped > 3
    assert examine(integrated(DAMPED, start, [1.0], Accuracy(1e-6, 2.0))).undamped < 1


def test_the_longest_step():
    found = examine(integrated(CHASE, [1.0, 0.0], [1.0], Accuracy(1e-3, 1e-3)))
    assert found.by_longest and found.longer == pytest.approx(0.25, abs=0.01)


def test_the_state_that_demands_the_steps_and_the_scale():
    system = System(swing, np.array([1.0, 1.0, 1.0, 100.0]))
    start, accuracy = np.array([[1.0, 0.0, 1.0, 0.0]]), Accuracy(1e-6, 1.0)
    found = examine(integrated(system, start[0], [0.0], accuracy))
    assert found.demanding in (2, 3)
    assert max(found.alone[:2]) < 0.5 < min(found.alone[2:])
    scale = proposed_scale(system, start, np.zeros((1, 1)), ENDS, accuracy)
    np.testing.assert_allclose(scale, [1.0, 0.9, 1.0, 100.0], rtol=0.12)
    other = replace(system, scale=np.full(4, 1e6))
    np.testing.assert_array_equal(
        proposed_scale(other, start, np.zeros((1, 1)), ENDS, Accuracy(1e-12, 1.0)),
        scale,
    )


def test_errors_are_multiples_of_rtol():
    exact = examine(integrated(CHASE, [1.0, 0.0], [1.0], Accuracy(1e-6, 1.0)))
    assert 0.01 < exact.errors["states"] < 20


@pytest.mark.parametrize(("most", "ends"), [(5000, 0.5), (20, None)])
def test_where_a_trial_ended_and_by_which_state(most, ends):
    system = System(explosion, np.array([1.0, 1.0]), n_extremes=1)
    found = integrated(system, [0.0, 1.0], [0.0], Accuracy(1e-6, 0.1, most))
    time, state = found.solution.ended[0]
    assert state == 1 and "state 2 of 2" in found.failure
    assert time == pytest.approx(ends, abs=1e-6) if ends else 0 < time < 0.5
    good = integrated(CHASE, [1.0, 0.0], [1.0], Accuracy(1e-3, 1.0))
    assert good.failure == "" and np.isnan(good.solution.ended).all()


def test_an_audit_is_never_looser_than_the_run():
    tight = Accuracy(1e-4, 2.0, 7).tightened()
    assert tight == Accuracy(pytest.approx(1e-7), 0.5, 7)
    assert Accuracy(1e-13, 2.0).tightened().rtol == 1e-13


def test_sizes_are_those_of_every_step():
    """The speed is 133 for a few thousandths of the motion: between 200 samples."""
    system, accuracy = System(van_der_pol, np.array([2.0, 1.0])), Accuracy(1e-6, 200.0)
    start, parameters = np.array([[2.0, 0.0]]), np.array([[100.0]])
    ends = np.array([[0.0, 200.0]])
    scale = proposed_scale(system, start, parameters, ends, accuracy)
    np.testing.assert_array_equal(scale, [2.0, 100.0])


def test_a_stiff_model_that_fails_is_called_stiff_by_its_lambda():
    system = System(van_der_pol, np.array([2.0, 1e3]))
    accuracy = Accuracy(1e-6, 500.0, 2000)
    examination = examine(integrated(system, [2.0, 0.0], [1e3], accuracy, 500.0))
    assert examination.failed.all() and examination.stiff
    # at x = 2: mu (x^2 - 1)
    assert examination.stiffness.rate == pytest.approx(3e3, rel=0.1)
    assert "another tool, or its FMU" in examination.stiffness.words


@pytest.mark.parametrize(
    ("rates", "start", "end", "growth"),
    [
        (lorenz, [1.0, 1.0, 20.0], 15.0, 1e3),
        (hanging, [np.pi - 1e-4, 0.0], 30.0, 1e3),
        # ten orbits, of eccentricity 0.9: it grows with their number
        (kepler, [0.1, 0.0, 0.0, np.sqrt(19.0)], 20 * np.pi, 100.0),
    ],
)
def test_sensitive_motions_are_called_so(rates, start, end, growth):
    system = System(rates, np.ones(len(start)))
    examination = examine(integrated(system, start, [0.0], Accuracy(1e-6, end), end))
    assert examination.sensitive and examination.growth > growth
    assert not (examination.kinked or examination.stiff)


def test_a_push_inside_a_step_is_seen_by_the_survey():
    system = System(pushed, np.array([1.0]))
    starts, parameters = np.zeros((64, 1)), np.full((64, 1), 0.02)
    ends = np.tile([0.0, 2.0], (64, 1))
    with observed(surveyed=True) as seen:
        solution = integrate(system, starts, parameters, ends, Accuracy(1e-6, 2.0))
    # all steps jumped over it: the rate is 50 there
    assert (solution.states[:, -1] == 0.0).all()
    residual = largest_residual(seen)
    assert residual.kinked and residual.of_rtol > 1e5
    assert 1.0 < residual.time < 1.02 and residual.row == 0
    plain = integrate(system, starts, parameters, ends, Accuracy(1e-6, 2.0))
    np.testing.assert_array_equal(plain.states, solution.states)
    assert plain.survey.shape == (64, 0, 3)


@pytest.mark.parametrize("name", ["khpt75", "khpt75-play", "ring"])
def test_no_shipped_machine_is_called_kinked(name):
    study = load(ROOT / "runs" / f"{name}.toml")
    assert kinks_of(study.model, study.settings) == ()


def test_the_stand_jumps_over_nothing_and_a_push_beside_a_damped_state_is_seen():
    study = load(ROOT / "runs" / "khpt75.toml")
    for speed in (7.5, 15.0):
        settings = replace(study.settings, crank_speed=speed)
        seen = surveyed(study.model, study.deviations()[:32], settings)
        assert seen[0].system.damped and not largest_residual(seen).kinked
    system = System(pushed_follower, np.array([1.0, 1.0]), damped=(1,))
    ends, accuracy = np.tile([0.0, 2.0], (64, 1)), Accuracy(1e-3, 0.3)
    for width, kinked in ((2e-4, True), (1e9, False)):
        parameters = np.full((64, 1), width)
        with observed(surveyed=True) as seen:
            integrate(system, np.ones((64, 2)), parameters, ends, accuracy)
        assert largest_residual(seen).kinked == kinked
