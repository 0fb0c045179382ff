"""Trials: rings integrated over the duration, and their responses."""

from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array
from tolstat.machines.ring.declarations import NO_REST, Asked, description_of
from tolstat.machines.ring.flutter import flutter_speed
from tolstat.machines.ring.harmonics import harmonics, shared, total
from tolstat.machines.ring.linear import growth_rate, static_depth, terms_of
from tolstat.machines.ring.motion import cutting_forces
from tolstat.machines.ring.parameters import Rings, build, out_of_roundness
from tolstat.model.contract import Outcome
from tolstat.moving import Accuracy, Solution, System, integrate
from tolstat.status import Status

DEPTH, TRAVEL, ROLLER_1, ROLLER_2 = range(4)  # rows with extremes
OUT = 4  # the row timed above zero, where forces have a kink: -t_R
G = 9.81  # m/s2


class Trials(NamedTuple):
    """A block of trials, and their motion."""

    rings: Rings
    solution: Solution  # states are a, b, a', b' of harmonics 2 to N, X, X'


def simulated(
    deviations: Array, settings: Asked, samples: Array | None = None
) -> Trials:
    """Integrate trials from the engagement on; states at the sample times, s."""
    # only a simulation needs the compiler
    from tolstat.machines.ring.compiled import rates

    rings = build(deviations, settings)
    machines, scale = rows_of(rings, settings), scale_of(settings)
    system = System(rates, scale, n_extremes=4, n_above=1, crossings=(OUT,))
    start = np.zeros((len(machines), len(scale)))
    marks = np.tile([0.0, settings.duration], (len(machines), 1))
    accuracy = Accuracy(settings.rtol, settings.step)
    solution = integrate(system, start, machines, marks, accuracy, samples=samples)
    return Trials(rings, solution)


def rows_of(rings: Rings, settings: Asked) -> Array:
    """Return float64[trial, parameter], as the equations of motion read them.

    First the fields of `motion.Tool`, then those of `motion.Ring`. For each lobe of any
    trial its number and its two parts follow.
    """
    k, on, tool_place = harmonics(settings.harmonics), rings.on, rings.tool_place
    x = terms_of(rings, rings.Omega, settings.hoop)
    ones = np.ones_like(rings.Omega)
    tool = (
        1.0 / rings.m_c, rings.c_c, rings.K_C, rings.t_R0,
        rings.c_R, rings.x_R, rings.c_T, rings.x_T, rings.Omega, 1.0 / rings.pi_chi,
        shared(on.s, k.C), shared(on.t, k.C),
        rings.pi_chi, np.cos(rings.theta_R), np.sin(rings.theta_R),
        1.0 / np.cos(rings.alpha), 1.0 / np.sin(rings.alpha),
    )  # fmt: skip
    per_C = np.broadcast_to(1.0 / k.C, on.s.shape)
    blank = [
        part
        for i, lobe in enumerate(rings.lobes)
        # a round trial adds zeros, bit for bit: no answer depends on them
        if (rings.e_cos[:, i] != 0.0).any() or (rings.e_sin[:, i] != 0.0).any()
        for part in (lobe * ones, rings.e_cos[:, i], rings.e_sin[:, i])
    ]
    ring = (per_C, x.d, x.gyro, x.M, x.g, on.s, on.t, *tool_place)
    return np.hstack([np.stack([*tool], axis=1), *ring, *(e[:, None] for e in blank)])


def scale_of(settings: Asked) -> Array:
    """Return float64[state]: the size that each state's error is measured by.

    Displacements by the nominal depth of cut; speeds by that times the frequency of the
    nominal tool, or of the harmonic alone where it is faster.
    """
    n = settings.harmonics - 1
    n_deviations = len(description_of(settings).contributors)
    nominal = build(np.zeros((1, n_deviations)), settings)
    k = harmonics(settings.harmonics)
    omega_c = np.sqrt(settings.tool_stiffness / settings.tool_mass)
    omega = np.maximum(omega_c, np.sqrt(nominal.nu[0] / k.C) * k.n)
    unit = np.concatenate([np.ones(2 * n), omega, omega, [1.0, omega_c]])
    return settings.depth * unit


def depth_of_cut(rings: Rings, states: Array, time: Array | float) -> Array:
    """Return t_R, m, of states[trial, state] at a time, s; one trial's at several."""
    n = rings.on.s.shape[1]
    tool = rings.tool_place
    moved = tool.u_a * states[:, :n] + tool.u_b * states[:, n : 2 * n]
    return rings.t_R0 + states[:, 4 * n] + total(moved) + out_of_roundness(rings, time)


def outcome_of(trials: Trials, settings: Asked) -> Outcome:
    """Return the responses in the order of `description_of`, and the failures."""
    rings, solution = trials.rings, trials.solution
    least, greatest = solution.least[:, DEPTH], solution.greatest[:, DEPTH]
    rest = static_depth(rings, settings.hoop)
    # each roller bears half the ring, and holds until it would pull with more
    dead_load = rings.pi_chi * G / np.cos(rings.alpha)
    columns = [
        least,
        greatest,
        depth_of_cut(rings, solution.states[:, -1], settings.duration),
        *((rest, rings.t_R0 - rest) if settings.rests else ()),
        rings.t_R0 - least,
        # a sum of steps may exceed the duration by a rounding
        np.minimum(solution.above[:, 0] / settings.duration, 1.0),
        solution.peak[:, TRAVEL],
        solution.least[:, ROLLER_1],
        solution.greatest[:, ROLLER_1],
        solution.least[:, ROLLER_2],
        solution.greatest[:, ROLLER_2],
        solution.greatest[:, ROLLER_1 : ROLLER_2 + 1].max(axis=1) / dead_load,
        # the forces rise with the depth
        *cutting_forces(greatest, rings),
    ]
    if not settings.hoop:
        root = np.sqrt(rings.nu)
        onset = flutter_speed(rings.alpha, settings.support_angle, settings.harmonics)
        columns += [2.0 * root, onset * root]
    if settings.rests:
        columns.append(growth_rate(rings, rest, settings.hoop))
    no_rest = (solution.status == Status.DONE) & np.isnan(rest) & settings.rests
    responses = np.stack(columns, axis=1)
    return Outcome(responses, solution.status, solution.steps, {NO_REST: no_rest})
