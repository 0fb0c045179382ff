"""Trials: chains followed over the horizon, as linear motion exactly.

Rows are of the twists of the springs, not of angles: a stiff spring behind a soft one
keeps the digits of its torque. Each is counted from where it would rest under the load,
so that it is driven by the programmed acceleration alone, and jumps where the load
steps. Rows are sqrt(c_s) times the twists, sqrt(J_s) times the speeds of the masses
against the programmed motion: half their squares add up to the energy. Then for each
part of the programmed motion phi0'' and its derivatives, each over one more power of a
rate and times sqrt(sum of J).
"""

from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array
from tolstat.machines.elastic_machine import parameters
from tolstat.machines.elastic_machine.declarations import Settings
from tolstat.machines.elastic_machine.parameters import Chains, Programme
from tolstat.moving import Accuracy, LinearMotion, Solution, System, integrate, solve

Entries = dict[tuple[int, int], Array]
SLOW = 0.02  # of the fastest mass on its spring: the rate that scales phi0''


def generator(chains: Chains, turns: list[Array], order: int, rate: Array) -> Entries:
    """Return G by row and column."""
    J, c, b = chains[:3]
    n, ones = J.shape[1], np.ones(len(J))
    entries: Entries = {}
    for s in range(n):
        entries[s, n + s] = np.sqrt(c[:, s] / J[:, s])
        entries[n + s, n + s] = -b[:, s] / J[:, s]
        entries[n + s, 2 * n] = -rate * np.sqrt(J[:, s] / J.sum(axis=1))
    for s in range(1, n):
        entries[s, n + s - 1] = -np.sqrt(c[:, s] / J[:, s - 1])
        entries[n + s - 1, n + s - 1] -= b[:, s] / J[:, s - 1]
        coupling = b[:, s] / np.sqrt(J[:, s] * J[:, s - 1])
        entries[n + s, n + s - 1] = entries[n + s - 1, n + s] = coupling
    for (i, j), value in list(entries.items()):
        if i < n:
            entries[j, i] = -value
    for part, turn in enumerate(turns):
        first = 2 * n + part * order
        for s in range(n):
            entries[n + s, first] = entries[n + s, 2 * n]
        for i in range(first, first + order - 1):
            entries[i, i + 1] = rate * ones
        if turn.any():
            entries[first + 2, first + 1] = -turn * turn / rate
    return entries


def driving(time: Array, programme: Programme, piece: int) -> Array:
    """Return phi0'' and its derivatives in a piece, float64[trial, 4]."""
    f, w = programme.f[:, piece], programme.turn[:, piece]
    x = time - programme.begin[:, piece]
    if w.any():
        bend = f[:, 2]
        half = np.sin(0.5 * w * x) / w
        rate, last = np.sin(w * x) / w, np.cos(w * x)
        return np.stack([2 * bend * half * half, bend * rate, bend * last, 0 * x], 1)
    shifted = np.zeros_like(f)
    for i in range(4):
        for j in range(3, i - 1, -1):
            shifted[:, i] = shifted[:, i] * x / (j - i + 1) + f[:, j]
    return shifted


def motion_of(chains: Chains, programme: Programme, settings: Settings) -> LinearMotion:
    """Return the chains of a block as linear motion.

    Watched are, as in `motion.loads`, theta and what is left of it after the programmed
    motion, of each mass, but in place of the torques the twists of the springs.
    """
    J, c = chains[:2]
    n, law, marks = J.shape[1], settings.law, programme.marks
    order = 3 if law.turn else max(len(piece) for piece in law.pieces)
    law_pieces = len(law.pieces)
    parts = range(programme.begin.shape[1] // law_pieces)
    turns = [programme.turn[:, i * law_pieces] for i in parts]
    rate = np.max([SLOW * np.sqrt(c / J).max(axis=1), *turns], axis=0)
    entries = generator(chains, turns, order, rate)
    scale = np.sqrt(J.sum(axis=1))[:, None] / rate[:, None] ** np.arange(1, order + 1)
    phases = marks.shape[1] - 1
    rest = np.zeros((len(J), phases, 3 * n))  # of theta, nothing, of the twists
    change = np.zeros((len(J), phases, 2 * n + order * len(parts)))
    for phase in range(phases):
        for i, step in enumerate(settings.load_torque):
            acts = np.where(programme.begun[:, i] <= phase, chains.M[:, i], 0.0)
            rest[:, phase, :n] += acts[:, None] * parameters.of_unit_torque(
                c, step["mass"]
            )
            mass = step["mass"]
            rest[:, phase, 2 * n : 2 * n + mass] += acts[:, None] / c[:, :mass]
        for piece in range(programme.begin.shape[1]):
            holds = (programme.on[:, piece] <= phase) & (
                phase < programme.until[:, piece]
            )
            f = scale * driving(marks[:, phase], programme, piece)[:, :order]
            first = 2 * n + piece // law_pieces * order
            change[:, phase, first : first + order] += np.where(holds[:, None], f, 0)
    steps = np.diff(rest[:, :, 2 * n :], axis=1, prepend=0.0)
    change[:, :, :n] = -np.sqrt(c)[:, None] * steps
    G = np.stack(list(entries.values()), axis=1)
    G[parameters.ends_late(chains, settings)] = (
        np.nan
    )  # ends as "not finite", without motion
    twists = np.eye(n) / np.sqrt(c)[:, None]
    angles = np.tri(n) / np.sqrt(c)[:, None]
    since = np.zeros((len(J), 3 * n))
    since[:, n : 2 * n] = programme.until[:, -1:]
    return LinearMotion(
        1, order * len(parts), np.array(list(entries)), G, marks, change,
        np.concatenate([angles, angles, twists], axis=1), rest, since,
    )  # fmt: skip


MOST_EXACT = 32  # masses


class Trials(NamedTuple):
    """A block of trials, and their motion."""

    chains: Chains
    programme: Programme
    solution: Solution  # its peaks: errors, residuals, torques; histories: errors first


def simulated(
    deviations: Array, settings: Settings, samples: Array | None = None
) -> Trials:
    """Follow trials over the horizon, with theta at the sample times.

    The motion is linear between two events, so it is solved exactly. Audits integrate
    it by Runge-Kutta; so are long chains, whose exact steps grow with the square of
    the number of masses.
    """
    chains = parameters.build(deviations, settings)
    programme = parameters.programme_of(chains, settings)
    n = len(settings.inertia)
    if not settings.runge_kutta and n <= MOST_EXACT:
        solution = solve(motion_of(chains, programme, settings), samples)
        for extreme in (solution.greatest, solution.least):
            extreme[:, 2 * n :] *= chains.c
        return Trials(chains, programme, solution)
    # only an integration needs these equations compiled
    from tolstat.machines.elastic_machine.compiled import rates, watch

    machines = parameters.rows_of(chains, programme, settings)
    solution = integrate(
        System(rates, parameters.scale_of(settings), watch, n_extremes=3 * n),
        np.zeros((len(machines), 2 * n)),
        machines,
        programme.marks,
        Accuracy(settings.rtol, settings.max_step),
        samples=samples,
    )
    return Trials(chains, programme, solution)
