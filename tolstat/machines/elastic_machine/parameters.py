"""Chains and their events, from the deviations of their parts."""

from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array, Truths
from tolstat.machines.elastic_machine.declarations import Settings
from tolstat.machines.elastic_machine.modes import natural_frequencies
from tolstat.machines.elastic_machine.motion import PIECE

BALANCED = 1e-12  # of a deflection: what rounding leaves where torques balance


class Chains(NamedTuple):
    """The trials of a block by the paper's letters, SI."""

    J: Array  # [trial, mass]
    c: Array  # [trial, mass], of the spring before it
    b: Array  # [trial, mass], of the same spring
    t0: Array  # [trial]
    M: Array  # [trial, step of the load]
    t_b: Array  # [trial], 0 without braking


class Programme(NamedTuple):
    """The programmed motion, piece by piece: start-up, then braking; and load steps."""

    begin: Array  # [trial, piece], s
    end: Array  # [trial, piece], s
    f: Array  # [trial, piece, 4], phi0'' at the begin, and three derivatives
    turn: Array  # [trial, piece], rad/s, see `start_up.Law`
    # a trial's phases are numbers of the last mark passed
    marks: Array  # [trial, mark], s: start, events in order of time, horizon
    on: Array  # [trial, piece], phase from which it holds
    until: Array  # [trial, piece], and from which no more
    begun: Array  # [trial, step of the load], phase from which it acts


def exist(chains: Chains) -> Truths:
    """Return which trials can be built."""
    J, c, b, t0, _, t_b = chains
    # the nominal braking time is 0 or above: a deviation must not turn it round
    return ((J > 0) & (c > 0) & (b >= 0)).all(axis=1) & (t0 > 0) & (t_b >= 0)


def build(deviations: Array, settings: Settings) -> Chains:
    """Return the chains of deviations[trial, contributor]."""
    n = len(settings.inertia)
    J = np.array(settings.inertia) * (1.0 + deviations[:, :n])
    c = np.array(settings.stiffness) * (1.0 + deviations[:, n : 2 * n])
    b = np.array(settings.damping) * (1.0 + deviations[:, 2 * n : 3 * n])
    t0 = settings.nominal_start_up + deviations[:, 3 * n]
    torque = [step["torque"] for step in settings.load_torque]
    last = 3 * n + 1 + len(torque)
    M = np.array(torque, float) + deviations[:, 3 * n + 1 : last]
    t_b = 0.0 * t0
    if settings.braking_time:
        t_b = settings.braking_time + deviations[:, last]
    return Chains(J, c, b, t0, M, t_b)


def ends_late(chains: Chains, settings: Settings) -> Truths:
    """Return which trials start into their braking, or move beyond the horizon."""
    if not settings.braking_time:
        return np.asarray(chains.t0 >= settings.horizon)
    late = chains.t0 > settings.braking_start
    return late | (settings.braking_start + chains.t_b >= settings.horizon)


def programme_of(chains: Chains, settings: Settings) -> Programme:
    """Return phi0'' = speed/t0 f(t/t0), and from t_B on -speed/t_b f((t - t_B)/t_b).

    A longer start-up may pass the time of a load step. So each trial stores the phase
    that each of its events begins, in order of time.
    """
    law = settings.law
    s = np.array((0.0, *law.knots, 1.0))
    table = np.zeros((len(law.pieces), 4))
    for row, piece in zip(table, law.pieces, strict=True):
        row[: len(piece)] = piece
    parts = [(0.0, chains.t0, settings.speed)]
    if settings.braking_time:
        parts.append((settings.braking_start, chains.t_b, -settings.speed))
    pieces = []
    for start, T, speed in parts:
        t = start + T[:, None] * s
        power = T[:, None] ** -np.arange(1.0, 5.0)
        f = speed * table * power[:, None, :]
        turn = np.broadcast_to(law.turn / T[:, None], f.shape[:2])
        pieces.append((t[:, :-1], t[:, 1:], f, turn))
    begin, end, f, turn = (np.hstack(values) for values in zip(*pieces, strict=True))
    n = len(law.pieces)
    # the ends of start-up and braking, then what begins behind t = 0
    of_pieces = np.hstack([end[:, n - 1 :: n], begin[:, 1:]])
    steps = [step["time"] for step in settings.load_torque]
    of_steps = np.broadcast_to(np.array(steps, float), (len(of_pieces), len(steps)))
    # what does not end has no answer; its marks end with the horizon
    times = np.hstack([np.minimum(of_pieces, settings.horizon), of_steps])
    order = np.argsort(times, axis=1, kind="stable")
    phase = np.empty_like(times)
    np.put_along_axis(phase, order, 1.0 + np.arange(times.shape[1])[None], axis=1)
    ordered = np.take_along_axis(times, order, axis=1)
    edge = np.zeros((len(of_pieces), 1))
    marks = np.hstack([edge, ordered, edge + settings.horizon])
    on = np.hstack([edge, phase[:, len(parts) : of_pieces.shape[1]]])
    until = np.hstack([on[:, 1:], edge])
    until[:, n - 1 :: n] = phase[:, : len(parts)]
    begun = phase[:, of_pieces.shape[1] :]
    return Programme(begin, end, f, turn, marks, on, until, begun)


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
    eps_max = settings.law.greatest * settings.speed / chains.t0
    deflection = static_deflection(chains.c, -chains.J * eps_max[:, None])
    for i, step in enumerate(settings.load_torque):
        acts = np.where(step["time"] <= chains.t0, chains.M[:, i], 0.0)
        deflection = deflection + acts[:, None] * of_unit_torque(chains.c, step["mass"])
    return deflection


def deflected_at_start_up(settings: Settings) -> tuple[int, ...]:
    """Return the masses, from 1, with a static error: the load leaves one.

    It may come after the start-up of a machine that stands, or balance it.
    """
    n = len(settings.inertia)
    # one more for braking
    nominal = build(np.zeros((1, 3 * n + 2 + len(settings.load_torque))), settings)
    deflection = np.abs(deflection_at_start_up(nominal, settings)[0])
    deflected = deflection > BALANCED * scale_of(settings)[:n]
    return tuple((1 + np.flatnonzero(deflected)).tolist())


def rows_of(chains: Chains, programme: Programme, settings: Settings) -> Array:
    """Return float64[trial, parameter], as the equations of motion read them.

    First the phase from which the programmed motion is over and the number of its
    pieces, then 1/J, c and b of each mass, then what `motion.Piece` names, then of each
    step of the load its phase and the static deflection of each mass.
    """
    # a start-up after the horizon ends as "not finite", without motion
    ones = np.where(ends_late(chains, settings), np.nan, 1.0)[:, None]
    begin, _, f, turn, _, on, until, begun = programme
    pieces = np.concatenate([np.stack([on, until, begin], 2), f, turn[:, :, None]], 2)
    number = np.full_like(ones, on.shape[1])
    rows = [until[:, -1:], number, 1.0 / chains.J, chains.c, ones * chains.b]
    rows.append(pieces.reshape(len(ones), PIECE * on.shape[1]))
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
    times = [settings.nominal_start_up]
    if settings.braking_time:
        times.append(settings.braking_time)
    eps_max = abs(settings.law.greatest * settings.speed) / min(times)
    theta = static_deflection(c, J * eps_max)
    for step in settings.load_torque:
        theta = theta + abs(step["torque"]) * of_unit_torque(c, step["mass"])
    k_1 = natural_frequencies(J, c)[0, 0]
    swings = static_deflection(c, k_1**2 * J * theta)
    twist = np.maximum(*(np.diff(x[0], prepend=0.0) for x in (theta, swings)))
    scale = np.minimum(twist, np.append(twist[1:], np.inf))
    return np.concatenate([scale, k_1 * scale])
