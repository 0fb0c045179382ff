"""Known answers, order, marks, peaks, failures, and lanes that never mix."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.integrator.conftest import pendulum
from tolstat.integrator.integrate import integrate
from tolstat.integrator.problem import Accuracy, System
from tolstat.status import Status

OMEGA2 = np.linspace(1.0, 4.0, 37)


def swing(system, accuracy, omega2=OMEGA2, marks=(0.0, 1.0, 10.0), **options):
    n = len(omega2)
    start = np.tile([1.0, 0.0], (n, 1))
    parameters = np.stack([omega2, np.full(n, 0.3)], axis=1)
    return integrate(
        system, start, parameters, np.tile(marks, (n, 1)), accuracy, **options
    )


def test_oscillator_against_its_closed_form(oscillator_system):
    found = swing(
        oscillator_system,
        Accuracy(1e-11, 0.1),
        watch_from=1,
        samples=np.linspace(0, 10, 23),
    )
    omega = np.sqrt(OMEGA2)
    assert np.all(found.status == Status.DONE)
    np.testing.assert_allclose(found.states[:, 1, 0], np.cos(omega), atol=1e-9)
    np.testing.assert_allclose(found.states[:, 2, 0], np.cos(10 * omega), atol=1e-9)
    work = OMEGA2 * (5 - np.sin(20 * omega) / (4 * omega))
    np.testing.assert_allclose(found.quadratures[:, 2, 0], work, rtol=1e-8)
    t = np.linspace(0, 10, 23)
    exact = np.cos(np.outer(omega, t))
    np.testing.assert_allclose(found.history[:, :, 0], exact, atol=1e-8)


def test_peaks_and_shares_between_the_steps(oscillator_system):
    found = swing(oscillator_system, Accuracy(1e-7, 0.1), watch_from=1)
    t = np.linspace(1, 10, 900_001)
    for i, omega in enumerate(np.sqrt(OMEGA2)):
        x = np.cos(omega * t)
        assert found.greatest[i, 0] == pytest.approx(x.max(), abs=2e-6)
        assert found.least[i, 0] == pytest.approx(x.min(), abs=2e-6)
        assert found.above[i, 0] == pytest.approx(9 * np.mean(x > 0.3), abs=6e-4)


def test_observed_order_is_five(oscillator_system):
    errors = []
    for h in (0.1, 0.05, 0.025):
        # a huge rtol leaves the step at its limit
        found = swing(oscillator_system, Accuracy(1e9, h), marks=(0.0, 10.0))
        errors.append(
            np.abs(found.states[:, 1, 0] - np.cos(10 * np.sqrt(OMEGA2))).max()
        )
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all((orders > 4.8) & (orders < 5.3)), orders


def test_a_step_lands_exactly_on_every_mark(oscillator_system):
    # two at once, and one a hair behind another
    marks = (0.0, 0.1, 0.1, 0.3, 0.3 + 1e-13, 0.7, 1.1, 3.3000000000000003)
    found = swing(oscillator_system, Accuracy(1e-9, 0.1), marks=marks)
    exact = np.cos(np.outer(np.sqrt(OMEGA2), marks))
    np.testing.assert_allclose(found.states[:, :, 0], exact, atol=1e-8)
    np.testing.assert_array_equal(found.states[:, 1], found.states[:, 2])


def test_a_trial_that_diverges_is_detected(blow_up_system):
    start = np.array([[0.5], [2.0], [np.nan], [0.1], [np.inf]])
    parameters = np.zeros((5, 1))
    marks = np.tile([0.0, 1.0], (5, 1))
    found = integrate(blow_up_system, start, parameters, marks, Accuracy(1e-6, 0.1))
    assert found.status[0] == Status.DONE
    assert found.states[0, 1, 0] == pytest.approx(1.0, abs=1e-5)
    assert found.status[1] in (Status.STEP_TOO_SMALL, Status.NOT_FINITE)
    assert found.status[2] == found.status[4] == Status.NOT_FINITE
    assert found.status[3] == Status.DONE
    assert np.all(np.isnan(found.states[[1, 2, 4], 1]))


def test_leaving_the_domain_is_not_finite(blow_up_system):
    # y' = sqrt(1 - y) from y = 1.5: the rate does not exist
    found = integrate(
        blow_up_system,
        np.array([[1.5]]),
        np.ones((1, 1)),
        np.array([[0.0, 1.0]]),
        Accuracy(1e-6, 0.1),
    )
    assert found.status[0] == Status.NOT_FINITE


def test_rejected_steps_leave_no_trace(kick_system):
    """At a jump that no mark announces steps are rejected until they are short."""
    kicks = np.array([[1.0], [100.0], [1e4]])
    marks = np.tile([0.0, 2.0], (3, 1))
    found = integrate(kick_system, np.zeros((3, 1)), kicks, marks, Accuracy(1e-8, 0.1))
    smooth = integrate(
        kick_system, np.zeros((3, 1)), 0 * kicks, marks, Accuracy(1e-8, 0.1)
    )
    assert np.all(found.steps > smooth.steps + 5)
    np.testing.assert_allclose(found.states[:, 1, 0], 1.5 * kicks[:, 0], rtol=1e-6)
    integral = kicks[:, 0] * 1.5**2 / 2
    np.testing.assert_allclose(found.quadratures[:, 1, 0], integral, rtol=1e-6)


def test_too_many_steps(oscillator_system):
    found = swing(oscillator_system, Accuracy(1e-11, 0.1, max_steps=50))
    assert np.all(found.status == Status.TOO_MANY_STEPS)
    assert np.all(found.steps == 50)
    assert np.all(np.isnan(found.greatest))


def test_step_too_small(oscillator_system):
    # no step satisfies such a tolerance: rounding errors exceed it
    found = swing(oscillator_system, Accuracy(1e-40, 0.1))
    assert np.all(found.status == Status.STEP_TOO_SMALL)


def test_a_watched_quantity_that_is_not_finite_is_detected(oscillator_system):
    start = np.array([[1.0, 0.0]])
    parameters = np.array([[1.0, np.nan]])  # enters only what is watched
    marks = np.array([[0.0, 1.0]])
    found = integrate(oscillator_system, start, parameters, marks, Accuracy(1e-6, 0.1))
    assert found.status[0] == Status.NOT_FINITE


def test_an_empty_duration_is_done_at_once(oscillator_system):
    found = swing(oscillator_system, Accuracy(1e-6, 0.1), marks=(2.0, 2.0))
    assert np.all(found.steps == 0)


def test_lanes_never_mix(blow_up_system):
    """Alone, among others, among others that fail: the same to the last bit."""
    rng = np.random.default_rng(6)
    start = rng.uniform(0.1, 0.9, (60, 1))
    start[::7] = 3.0  # these fail
    start[5] = np.nan
    parameters = np.zeros((60, 1))
    marks = np.tile([0.0, 1.0], (60, 1))
    accuracy = Accuracy(1e-8, 0.1)
    together = integrate(blow_up_system, start, parameters, marks, accuracy)
    order = rng.permutation(60)
    shuffled = integrate(blow_up_system, start[order], parameters, marks, accuracy)
    for i in range(60):
        one = slice(i, i + 1)
        alone = integrate(
            blow_up_system, start[one], parameters[one], marks[one], accuracy
        )
        j = int(np.flatnonzero(order == i)[0])
        for name in ("states", "quadratures", "status", "steps"):
            values = getattr(together, name)[i]
            np.testing.assert_array_equal(values, getattr(alone, name)[0])
            np.testing.assert_array_equal(values, getattr(shuffled, name)[j])


def test_samples_do_not_change_the_march(oscillator_system):
    accuracy = Accuracy(1e-6, 0.1)
    plain = swing(oscillator_system, accuracy)
    sampled = swing(oscillator_system, accuracy, samples=np.linspace(0, 10, 500))
    np.testing.assert_array_equal(plain.states, sampled.states)
    assert np.all(np.isfinite(sampled.history))


@pytest.mark.parametrize("trials", [1, 3, 8])
def test_lanes_without_a_trial_leave_no_trace(trials):
    """The rates of this system are numbers even where there is no machine."""
    system = System(pendulum, np.array([1.0, 1.0]))
    start, p = np.tile([0.4, 0.0], (trials, 1)), np.ones((trials, 3))
    marks, time = np.tile([0.0, 0.8], (trials, 1)), np.linspace(0.0, 0.8, 5)
    found = integrate(system, start, p, marks, Accuracy(1e-6, 0.04), samples=time)
    np.testing.assert_array_equal(found.history[:, 0], start)
    np.testing.assert_allclose(found.history[:, -1], found.states[:, -1], rtol=1e-12)


def test_time_dependence_enters_at_the_right_times():
    from scipy.integrate import solve_ivp

    from tests.integrator.conftest import pendulum_rates

    system = System(pendulum, np.array([1.0, 1.0]))
    p = np.array([1.3, 0.2, 0.9])
    found = integrate(
        system,
        np.array([[0.4, 0.0]]),
        p[None],
        np.array([[0.0, 20.0]]),
        Accuracy(1e-11, 0.1),
    )
    exact = solve_ivp(
        lambda t, y: pendulum_rates(t, y, p), (0, 20), [0.4, 0.0], method="DOP853",
        rtol=1e-12, atol=1e-12,
    ).y[:, -1]  # fmt: skip
    np.testing.assert_allclose(found.states[0, 1], exact, atol=1e-8)


def test_errors_are_relative_to_the_scale(oscillator_system):
    fine = swing(oscillator_system, Accuracy(1e-6, 0.5))
    scaled = replace(oscillator_system, scale=np.array([10.0, 10.0]))
    same = swing(scaled, Accuracy(1e-7, 0.5))
    assert np.abs(fine.steps - same.steps).max() <= 2
