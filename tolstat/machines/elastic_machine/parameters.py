"""Chains and their events, from the deviations of their parts."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array, Truths
from tolstat.machines.elastic_machine.declarations import Settings
from tolstat.machines.elastic_machine.modes import natural_frequencies
from tolstat.machines.elastic_machine.start_up import LAWS

BALANCED = 1e-12  # of a deflection: what rounding leaves where torques balance


class Chains(NamedTuple):
    """The trials of a block by the paper's letters, SI."""

    J: Array  # [trial, mass]
    c: Array  # [trial, mass], of the spring before it
    b: Array  # [trial, mass], of the same spring
    t0: Array  # [trial]
    M: Array  # [trial, step of the load]


def exist(chains: Chains) -> Truths:
    """Return which trials can be built."""
    J, c, b, t0, _ = chains
    return ((J > 0) & (c > 0) & (b >= 0)).all(axis=1) & (t0 > 0)


def build(deviations: Array, settings: Settings) -> Chains:
    """Return the chains of deviations[trial, contributor]."""
    n = len(settings.inertia)
    J = np.array(settings.inertia) * (1.0 + deviations[:, :n])
    c = np.array(settings.stiffness) * (1.0 + deviations[:, n : 2 * n])
    b = np.array(settings.damping) * (1.0 + deviations[:, 2 * n : 3 * n])
    t0 = settings.start_up_time + deviations[:, 3 * n]
    torque = [step["torque"] for step in settings.load_torque]
    return Chains(J, c, b, t0, np.array(torque, float) + deviations[:, 3 * n + 1 :])


def static_deflection(c: Array, M: Array) -> Array:
    """Return C^-1 M, [trial, mass]: a spring carries all torques from its mass on."""
    carried = np.cumsum(M[:, ::-1], axis=1)[:, ::-1]
    return np.cumsum(carried / c, axis=1)


def of_unit_torque(c: Array, mass: int) -> Array:
    """Return float64[trial, mass]: C^-1 of 1 N m on one mass, counted from 1."""
    M = np.zeros_like(c)
    M[:, mass - 1] = 1.0
    return static_deflection(c, M)


def deflection_at_start_up(chains: Chains, settings: Settings) -> Array:
    """Return C^-1(-I 1 eps_max + M_end), float64[trial, mass].

    M_end are the torques at the end of start-up, with any that steps at that very
    moment.
    """
    greatest = LAWS[settings.start_up_law].greatest
    eps_max = greatest * settings.final_speed / chains.t0
    found = static_deflection(chains.c, -chains.J * eps_max[:, None])
    for i, step in enumerate(settings.load_torque):
        acts = np.where(step["time"] <= chains.t0, chains.M[:, i], 0.0)
        found = found + acts[:, None] * of_unit_torque(chains.c, step["mass"])
    return found


def deflected_at_start_up(settings: Settings) -> tuple[int, ...]:
    """Return the masses, from 1, with a static error: the load leaves one.

    It may come after the start-up of a machine that stands, or balance it.
    """
    n = len(settings.inertia)
    nominal = build(np.zeros((1, 3 * n + 1 + len(settings.load_torque))), settings)
    found = np.abs(deflection_at_start_up(nominal, settings)[0])
    there = found > BALANCED * scale_of(settings)[:n]
    return tuple((1 + np.flatnonzero(there)).tolist())


def events_of(chains: Chains, settings: Settings) -> tuple[Array, Array, Array]:
    """Return the knots and end of the start-up and the load steps, in order of time.

    A longer start-up may pass the time of a step. So each trial stores the phase that
    each of its events begins: the number of the last mark passed.

    Returns
    -------
    marks : float64[trial, mark]
        Start, events, horizon, s, in the order in which each trial has them.
    ended : float64[trial]
        The phase from which the start-up is over.
    begun : float64[trial, step of the load]
        The phase from which it acts.
    """
    parts = (*LAWS[settings.start_up_law].knots, 1.0)
    # a start-up that does not end has no answer; its marks end with the horizon
    own = np.minimum(chains.t0[:, None] * np.array(parts), settings.horizon)
    steps = [step["time"] for step in settings.load_torque]
    given = np.broadcast_to(np.array(steps, float), (len(own), len(steps)))
    times = np.hstack([own, given])
    order = np.argsort(times, axis=1, kind="stable")
    phase = np.empty_like(times)
    np.put_along_axis(phase, order, 1.0 + np.arange(times.shape[1])[None], axis=1)
    ordered = np.take_along_axis(times, order, axis=1)
    edge = np.zeros((len(own), 1))
    marks = np.hstack([edge, ordered, edge + settings.horizon])
    return marks, phase[:, len(parts) - 1], phase[:, len(parts) :]


def rows_of(chains: Chains, ended: Array, begun: Array, settings: Settings) -> Array:
    """Return float64[trial, parameter], as the equations of motion read them.

    First what `motion.StartUp` names, then 1/J, c and b of each mass, then of each
    step of the load its phase and the static deflection of each mass.
    """
    # a start-up after the horizon ends as "not finite", without motion
    one = np.where(chains.t0 < settings.horizon, 1.0, np.nan)
    start_up = (
        np.full_like(one, list(LAWS).index(settings.start_up_law)),
        one * settings.final_speed / chains.t0,
        one / chains.t0,
        ended,
    )
    rows = [np.stack(start_up, axis=1), 1.0 / chains.J, chains.c, chains.b]
    for i, step in enumerate(settings.load_torque):
        deflection = chains.M[:, i : i + 1] * of_unit_torque(chains.c, step["mass"])
        rows += [begun[:, i : i + 1], deflection]
    return np.hstack(rows)


def scale_of(settings: Settings) -> Array:
    """Return float64[state]: the size that each state's error is measured by.

    Deflections by the smaller twist of the springs on both sides, for a stiff spring
    behind a soft one carries no less: the nominal static twist, greatest acceleration
    and all steps of the load added up, or that of the lowest mode where it is larger.
    Speeds by these times the lowest natural frequency, rad/s.
    """
    J, c = np.array([settings.inertia]), np.array([settings.stiffness])
    greatest = LAWS[settings.start_up_law].greatest
    eps_max = greatest * abs(settings.final_speed) / settings.start_up_time
    theta = static_deflection(c, J * eps_max)
    for step in settings.load_torque:
        theta = theta + abs(step["torque"]) * of_unit_torque(c, step["mass"])
    k_1 = natural_frequencies(J, c)[0, 0]
    swings = static_deflection(c, k_1**2 * J * theta)
    twist = np.maximum(*(np.diff(each[0], prepend=0.0) for each in (theta, swings)))
    scale = np.minimum(twist, np.append(twist[1:], np.inf))
    return np.concatenate([scale, k_1 * scale])
