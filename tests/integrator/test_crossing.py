"""Kinks of the rates: a step ends at each, and none is missed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.integrator.switching import BALL, SWITCH, bouncing, bouncing_watch
from tolstat.errors import ModelError
from tolstat.integrator.integrate import integrate
from tolstat.integrator.problem import Accuracy, System
from tolstat.status import Status


def bounces(k, end):
    """x(end), x'(end), least x and the time above 0 of the ball from x = 1 at rest."""
    fall, v = np.sqrt(2.0), np.sqrt(2.0)
    w = np.sqrt(k)
    # below: x + 1/k = A cos(w t - phase), A^2 = 1/k^2 + v^2/k
    A = np.hypot(1.0 / k, v / w)
    contact = 2.0 * (np.pi - np.arccos(1.0 / (k * A))) / w
    period = contact + 2.0 * v
    since = (end - fall) % period
    whole = (end - fall) // period
    if since < contact:
        swing = w * (since - 0.5 * contact)
        x, x_ = -A * np.cos(swing) - 1.0 / k, A * w * np.sin(swing)
        up = fall + whole * 2.0 * v
    else:
        flown = since - contact
        x, x_ = v * flown - 0.5 * flown * flown, v - flown
        up = fall + whole * 2.0 * v + flown
    return x, x_, -A - 1.0 / k, up


def dropped(k, end, accuracy, system=BALL, top=0.0, **options):
    n = len(k)
    start, marks = np.tile([1.0 + top, 0.0], (n, 1)), np.tile([0.0, end], (n, 1))
    p = np.stack([k, np.full(n, top)], axis=1)
    return integrate(system, start, p, marks, accuracy, **options)


def test_a_ball_that_bounces_against_its_closed_form():
    k = np.geomspace(3.0, 3e4, 19)
    found = dropped(k, 50.0, Accuracy(1e-10, 0.5))
    known = np.array([bounces(each, 50.0) for each in k])
    np.testing.assert_allclose(found.states[:, 1, 0], known[:, 0], atol=3e-7)
    np.testing.assert_allclose(found.least[:, 0], known[:, 2], rtol=1e-8)
    np.testing.assert_allclose(found.above[:, 0], known[:, 3], atol=3e-7)


def test_a_kink_that_is_not_named_costs_precision():
    k = np.geomspace(3.0, 3e4, 19)
    known = np.array([bounces(each, 50.0)[0] for each in k])
    named = dropped(k, 50.0, Accuracy(1e-8, 0.5))
    plain = dropped(k, 50.0, Accuracy(1e-8, 0.5), replace(BALL, crossings=()))
    errors = [np.abs(each.states[:, 1, 0] - known) for each in (named, plain)]
    assert np.median(errors[1]) > 20.0 * np.median(errors[0])
    assert named.steps.sum() < 1.1 * plain.steps.sum()


def test_a_visit_within_one_step_is_detected():
    """It lasts 4e-4 of a step of 0.5 and more; no stage of a blind step lies in it."""
    width = np.array([1e-3, 3e-4, 1e-4, 0.3])
    n = len(width)
    p = np.stack([np.full(n, 3.33), width**2, np.full(n, 7.7), 0.75 / width**3], axis=1)
    start, marks = np.zeros((n, 2)), np.tile([0.0, 10.0], (n, 1))
    found = integrate(SWITCH, start, p, marks, Accuracy(1e-6, 0.5))
    np.testing.assert_allclose(found.states[:, 1, 0], 1.0, rtol=1e-4)
    np.testing.assert_allclose(found.states[:, 1, 1], 2.3**2 / 2.0, rtol=1e-9)
    # a crossing is as sharp as 1e-9 of what the quantity is in the step
    np.testing.assert_allclose(found.above[:, 0], 10.0 - 2.0 * width, atol=2e-6)
    np.testing.assert_allclose(found.above[:, 1], 2.3, atol=1e-8)
    blind_system = replace(SWITCH, crossings=())
    blind = integrate(blind_system, start, p, marks, Accuracy(1e-6, 0.5))
    assert np.all(blind.states[:3, 1, 0] == 0.0)


@pytest.mark.parametrize("begins", [0.0, 1e-300, -1e-300, 5e-17, -5e-17])
def test_a_start_on_the_kink(begins):
    """From the kink upwards, downwards, and at rest on it, where it falls."""
    start = np.array([[begins, 2.0], [begins, -1.0], [begins, 0.0]])
    p, marks = np.tile([100.0, 0.0], (3, 1)), np.tile([0.0, 0.1, 5.0], (3, 1))
    found = integrate(BALL, start, p, marks, Accuracy(1e-10, 0.5))
    assert np.all(found.status == Status.DONE)
    y, v = found.states[:, -1, 0], found.states[:, -1, 1]
    energy = 0.5 * v * v + y + 50.0 * np.minimum(y, 0.0) ** 2
    np.testing.assert_allclose(energy, 0.5 * start[:, 1] ** 2, atol=1e-8)
    assert found.states[0, 1, 0] == pytest.approx(0.2 - 0.005, abs=1e-12)


def test_a_crossing_next_to_a_mark_and_a_mark_on_a_crossing():
    fall = np.sqrt(2.0)
    k = np.full(5, 40.0)
    off = np.array([-1e-9, -1e-13, 0.0, 1e-13, 1e-9])
    start = np.tile([1.0, 0.0], (5, 1))
    marks = np.stack([0.0 * off, fall + off, np.full(5, 20.0)], axis=1)
    p = np.stack([k, 0.0 * k], axis=1)
    found = integrate(BALL, start, p, marks, Accuracy(1e-10, 0.5))
    assert np.all(found.status == Status.DONE)
    np.testing.assert_allclose(found.states[:, 2, 0], bounces(40.0, 20.0)[0], atol=1e-7)
    assert found.steps.max() < found.steps.min() + 60


@pytest.mark.parametrize("top", [1e3, 1e6])
def test_a_crossing_that_rounding_blurs(top):
    """The quantity is a difference of numbers that are far greater than itself."""
    k = np.geomspace(3.0, 3e4, 61)
    known = np.array([bounces(each, 20.0)[0] for each in k])
    for rtol in (1e-6, 1e-9):
        found = dropped(k, 20.0, Accuracy(rtol, 0.5, 100_000), top=top)
        assert np.all(found.status == Status.DONE)
        assert np.all(found.steps < 4000)
    error = np.abs(found.states[:, 1, 0] - top - known)
    assert error.max() < 1e-4 + 1e-10 * top


def test_a_ball_that_hardly_touches():
    """It rests on the spring but for rounding: many visits, none deep."""
    start = np.array([[1e-12, 0.0], [1e-9, 0.0], [1e-6, 0.0]])
    p, marks = np.tile([1e4, 0.0], (3, 1)), np.tile([0.0, 0.5], (3, 1))
    found = integrate(BALL, start, p, marks, Accuracy(1e-6, 0.05))
    assert np.all(found.status == Status.DONE)
    assert np.all(found.steps < 2000)


def test_lanes_never_mix_where_some_cross():
    rng = np.random.default_rng(8)
    k = rng.uniform(1.0, 1e4, 29)
    accuracy, samples = Accuracy(1e-6, 0.3), np.linspace(0.0, 20.0, 50)
    together = dropped(k, 20.0, accuracy, samples=samples)
    order = rng.permutation(29)
    shuffled = dropped(k[order], 20.0, accuracy, samples=samples)
    for i in range(29):
        alone = dropped(k[i : i + 1], 20.0, accuracy, samples=samples)
        j = int(np.flatnonzero(order == i)[0])
        for name in ("states", "least", "above", "history", "steps"):
            values = getattr(together, name)[i]
            np.testing.assert_array_equal(values, getattr(alone, name)[0])
            np.testing.assert_array_equal(values, getattr(shuffled, name)[j])


def test_a_system_without_kinks_is_unchanged(oscillator_system):
    """Named, the sign of x only decides where steps end."""
    start, p = np.array([[1.0, 0.0]]), np.array([[4.0, 0.0]])
    marks = np.array([[0.0, 10.0]])
    named = replace(oscillator_system, crossings=(0,))
    plain = integrate(oscillator_system, start, p, marks, Accuracy(1e-8, 0.1))
    found = integrate(named, start, p, marks, Accuracy(1e-8, 0.1))
    np.testing.assert_allclose(found.states, plain.states, atol=1e-7)
    assert plain.steps[0] < found.steps[0] < plain.steps[0] + 40
    # cos 2t > 0 up to pi/4, for pi/2 twice, and from 11 pi/4 on
    assert found.above[0, 0] == pytest.approx(10.0 - 1.5 * np.pi, abs=1e-7)
    assert plain.above[0, 0] != pytest.approx(10.0 - 1.5 * np.pi, abs=1e-7)


@pytest.mark.parametrize("crossings", [(2,), (-1,), (0, 0), [0], (0.5,)])
def test_only_watched_quantities_can_cross(crossings):
    with pytest.raises(ModelError, match="crossings"):
        replace(BALL, crossings=crossings)
    with pytest.raises(ModelError, match="there are none"):
        System(bouncing, np.ones(2), bouncing_watch, crossings=(0,))
