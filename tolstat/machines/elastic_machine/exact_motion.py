"""The chain as linear motion, in the twists of its springs, for its exact solution.

Twists and not angles: a stiff spring behind a soft one keeps the digits of its torque.
Each is counted from where it would rest under the load, so that it is driven by the
programmed acceleration alone, and jumps where the load steps.
"""

import numpy as np

from tolstat.arrays import Array
from tolstat.machines.elastic_machine.declarations import Settings
from tolstat.machines.elastic_machine.modes import natural_frequencies
from tolstat.machines.elastic_machine.parameters import (
    Chains,
    Events,
    Programme,
    ends_late,
    of_unit_torque,
)
from tolstat.moving import LinearMotion

Entries = dict[tuple[int, int], Array]


def generator(chains: Chains, turns: list[Array], order: int) -> Entries:
    """Return G by row and column.

    Rows are twists, their rates, then phi0'' and derivatives for each part of it.
    """
    J, c, b = chains[:3]
    n, one = J.shape[1], np.ones(len(J))
    found: Entries = {(s, n + s): one for s in range(n)}
    for s in range(n):
        inner = 1.0 / J[:, s - 1] if s else 0.0 * one
        here = 1.0 / J[:, s]
        # what the torques of the springs s-1, s, s+1 do to the twist of s
        for r, pull in ((s - 1, inner), (s, -here - inner), (s + 1, here)):
            if 0 <= r < n:
                found[n + s, r] = pull * c[:, r]
                found[n + s, n + r] = pull * b[:, r]
    for part, turn in enumerate(turns):
        first = 2 * n + part * order
        found[n, first] = -one  # the first spring is twisted by phi0
        for i in range(first, first + order - 1):
            found[i, i + 1] = one
        if turn.any():
            found[first + 2, first + 1] = -turn * turn
    return dict(sorted(found.items()))


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


def motion_of(
    chains: Chains, programme: Programme, events: Events, settings: Settings
) -> LinearMotion:
    """Return the chains of a block as linear motion.

    Watched are, as in `motion.loads`, theta and what is left of it after the programmed
    motion, of each mass, but in place of the torques the twists of the springs.
    """
    J, c, b = chains[:3]
    n, law, marks = J.shape[1], settings.law, events.marks
    order = 3 if law.turn else max(len(piece) for piece in law.pieces)
    each = len(law.pieces)
    parts = range(programme.begin.shape[1] // each)
    entries = generator(chains, [programme.turn[:, i * each] for i in parts], order)
    phases = marks.shape[1] - 1
    rest = np.zeros((len(J), phases, 3 * n))  # of theta, nothing, of the twists
    change = np.zeros((len(J), phases, 2 * n + order * len(parts)))
    for phase in range(phases):
        for i, step in enumerate(settings.load_torque):
            acts = np.where(events.begun[:, i] <= phase, chains.M[:, i], 0.0)
            rest[:, phase, :n] += acts[:, None] * of_unit_torque(c, step["mass"])
            mass = step["mass"]
            rest[:, phase, 2 * n : 2 * n + mass] += acts[:, None] / c[:, :mass]
        for piece in range(programme.begin.shape[1]):
            holds = (events.on[:, piece] <= phase) & (phase < events.off[:, piece])
            now = driving(marks[:, phase], programme, piece)[:, :order]
            first = 2 * n + piece // each * order
            change[:, phase, first : first + order] += np.where(holds[:, None], now, 0)
    change[:, :, :n] = -np.diff(rest[:, :, 2 * n :], axis=1, prepend=0.0)
    k, d = natural_frequencies(J, c)[:, -1], natural_frequencies(J, b)[:, -1] ** 2
    G = np.stack(list(entries.values()), axis=1)
    G[ends_late(chains, settings)] = np.nan  # ends as "not finite", without motion
    within = [(o, i) for o in range(n) for i in range(o + 1)]
    sums = [
        *within,
        *((n + o, i) for o, i in within),
        *((2 * n + o, o) for o in range(n)),
    ]
    since = np.zeros((len(J), 3 * n))
    since[:, n : 2 * n] = events.off[:, -1:]
    fastest = 0.5 * (d + np.sqrt(d * d + 4.0 * k * k))
    return LinearMotion(
        n, np.array(list(entries)), G, fastest, marks, change, np.array(sums), rest,
        since,
    )  # fmt: skip
