"""Steps of linear equations by e^(G h), a trial in each lane.

z' = G z within a phase, so z(t + h) = P z(t) with P = e^(G h), the same in all its
steps.
"""

import numpy as np
from numba import types

from tolstat.integrator.linear_peaks import (
    BOUND,
    KEPT,
    LOOK_EVERY,
    MOST_STEPS,
    climb,
    greater,
    is_over,
    keep,
    pack_type,
    read,
    settle,
    sizes,
    take_peaks,
    take_samples,
    times,
)
from tolstat.lanes.compiled import compiled
from tolstat.lanes.rows import rows

MOST_TURN = 0.5 * np.pi  # of the fastest part in a step
TERMS = 24  # of e^(G h), which thousands of steps multiply: (pi/2)^25/25! = 5e-21


@compiled()
def measure(pack):
    """Fill of each part how fast it may turn and grow, 1/s, and its share in each sum.

    Norms of G by rows and columns bound its Euclidean one; Gershgorin's circles of its
    symmetric part bound the growth of |z|.
    """
    m, parts, watched = len(pack.z), pack.parts, len(pack.since)
    size, n = m // parts, len(pack.weight) // watched
    G, dense, marks = pack.G, pack.P, pack.marks
    share, weight = pack.share, pack.weight
    nothing = 0.0 * marks[0]
    for i in range(m * size):
        dense[i] = nothing
    for e in range(len(G)):
        dense[pack.row[e] * size + pack.column[e] // parts] = G[e]
    for k in range(parts):
        widest, highest, growth = nothing, nothing, nothing
        for i in range(size):
            width, height, grown = nothing, nothing, nothing
            for j in range(size):
                entry = dense[(i * parts + k) * size + j]
                back = dense[(j * parts + k) * size + i]
                width, height = width + np.abs(entry), height + np.abs(back)
                both = entry + back
                grown = grown + 0.5 * (both if i == j else np.abs(both))
            widest, highest = greater(width, widest), greater(height, highest)
            growth = greater(grown, growth)
        pack.turn[k], pack.growth[k] = np.sqrt(widest * highest), growth
        pack.ever[k] = np.exp(growth * (marks[len(marks) - 1] - marks[0]))
        for o in range(watched):
            square = nothing
            for i in range(k, n, parts):
                square = square + weight[o * n + i] * weight[o * n + i]
            share[o * parts + k] = np.sqrt(square)


@compiled()
def prepare(h, pack):
    """Fill what is the same in all steps of a phase: P = e^(G h), slopes, bounds."""
    m, parts, watched = len(pack.z), pack.parts, len(pack.since)
    size, n = m // parts, len(pack.weight) // watched
    G, P, length = pack.G, pack.P, pack.length
    power, product = pack.power, pack.product
    slope, weight = pack.slope, pack.weight
    for k in range(size):
        length[k] = h
    for i in range(m * size):
        power[i] = 0.0 * h + (1.0 if i % size == i // size // parts else 0.0)
        P[i] = power[i]
    for term in range(1, TERMS + 1):
        times(size, 1.0 / term, power, product, pack)
        for i in range(m * size):
            P[i] = P[i] + product[i]
        power, product = product, power
    for i in range(watched * n):
        slope[i] = 0.0 * h
    for e in range(len(G)):
        i, j, Gh = pack.row[e], pack.column[e] - n, G[e] * h
        if i < n:
            for o in range(0, watched * n, n):
                slope[o + j] = slope[o + j] + weight[o + i] * Gh
    for k in range(parts):
        grown = np.exp(pack.growth[k] * h * float(LOOK_EVERY))
        pack.soon[k] = grown * (1.0 / 144.0)


@compiled(within=True)
def advance(running, z, moved, pack):
    """Fill P z where trials run."""
    m, parts, P = len(z), pack.parts, pack.P
    size = m // parts
    for first in range(0, m, parts):
        for k in range(parts):
            i = first + k
            total = P[i * size] * z[k]
            for j in range(1, size):
                total = total + P[i * size + j] * z[j * parts + k]
            moved[i] = np.where(running, total, z[i])


@compiled(types.void(pack_type))
def follow(pack):
    """Follow the trials of a pack from the first mark to the last."""
    pack = rows(pack)
    m, watched, phases = len(pack.z), len(pack.since), len(pack.marks) - 1
    z, moved, change = pack.z, pack.moved, pack.change
    marks, clock, steps = pack.marks, pack.clock, pack.steps
    since, value = pack.since, pack.value
    n, rest = len(pack.weight) // watched, pack.rest
    extreme, candidates = pack.extreme, pack.candidates
    measure(pack)
    fastest = pack.turn[0]
    for k in range(1, pack.parts):
        fastest = greater(pack.turn[k], fastest)
    total = 0.0 * fastest
    for phase in range(phases):
        total = total - np.floor(
            (marks[phase] - marks[phase + 1]) * fastest / MOST_TURN
        )
    in_time = total <= MOST_STEPS
    searched, steps[0], clock[0] = in_time, np.where(in_time, 0.0, total), 0.0 * total
    for i in range(m):
        z[i] = 0.0 * total
    for phase in range(phases):
        for i in range(m):
            jump = change[phase * m + i]
            z[i] = z[i] + jump if i < m - pack.driven else jump
        span = marks[phase + 1] - marks[phase]
        count = greater(-np.floor(-span * fastest / MOST_TURN), 0.0 * span + 1.0)
        count = np.where(in_time & (span > 0.0), count, 0.0)
        running = count > 0.0
        h = span / greater(count, 0.0 * span + 1.0)
        if np.any(running & (h != clock[0])):  # equal phases in a row share P
            prepare(h, pack)
        clock[0], clock[1] = h, count
        for o in range(watched):
            value[o], pack.rate[o] = read(o, n, rest[phase * watched + o], z, pack)
            fresh = since[o] >= float(phase)
            for row in range(o, 2 * watched, watched):
                i = row * (KEPT + m) + BOUND
                candidates[i] = np.where(fresh, -np.inf, candidates[i])
                former = np.where(fresh, -np.inf, extreme[row])
                higher = greater(value[o] if row == o else -value[o], former)
                extreme[row] = np.where(running, higher, former)
        step = 0
        while np.any(running):
            if step % LOOK_EVERY == 0:
                sizes(z, pack)
                if phase == phases - 1:
                    searched = searched & ~is_over(phase, pack)
                    if len(pack.samples) == 0:
                        running = running & searched
            steps[0] = np.where(running & searched, steps[0] + 1.0, steps[0])
            advance(running, z, moved, pack)
            if np.any(take_peaks(phase, running, moved, pack)):
                keep(phase, h, running, z, pack)
            if len(pack.samples) > 0:
                take_samples(phase, step, z, pack)
            z, moved = moved, z
            step += 1
            running = running & (count > float(step))
    settle(0, 2 * watched, pack)
    for row in range(2 * watched):
        climb(row, candidates[row * (KEPT + m) + BOUND] > extreme[row], pack)
    for i in range(m):
        steps[0] = steps[0] + 0.0 * z[i]  # no number where the motion overflowed
