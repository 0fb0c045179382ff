"""Steps of linear equations, exact but for rounding, a trial in each lane.

z' = G z within a phase, so z(t + h) = P z(t) with P = e^(G h), the same in all its
steps. A watched quantity x is a sum of rows of z. Values and slopes at both ends of a
step give a cubic. At a share s of the step it is off by at most M s^2 (1 - s)^2/24, M
the largest fourth derivative of x by s. In Bernstein's form cubic and bound are not
above their greatest coefficient: a step may hold a new peak only where that is higher.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import types

from tolstat.arrays import Array, Integers
from tolstat.integrator.linear_motion import A_STEP, MOST_STEPS, SERIES, TERMS
from tolstat.integrator.signatures import integers, table
from tolstat.lanes.compiled import compiled
from tolstat.lanes.rows import rows
from tolstat.lanes.vector import WIDTH

OFTEN = 8  # steps between two looks at the sizes of the parts
SAME = 1e-14  # of a watched quantity: as high
ROUNDS = 1000  # of a search, at most; ten are usual
LATE = 1e-9  # of a step: what rounding may put a sample behind the last mark
SPAN, STEP, REST, BOUND, KEPT = range(5)  # rows of a kept step, then z


class Pack(NamedTuple):
    """Trials in lanes, and room for their steps."""

    # entries of G that are not zero in all trials, by rows: the first of each row and
    # behind all, their columns; the same of the watched sums, and of their slopes
    first_entry: Integers
    column: Integers
    first_summed: Integers
    summed: Integers
    first_sloped: Integers
    sloped: Integers
    product: Integers  # [3 times number]: entry of a slope, of the sum, of G
    driven: Integers  # [1], how many rows of each part drive the others
    marks: Array  # [mark, lane], s
    G: Array  # [entry, lane], 1/s
    weight: Array  # [summed, lane]
    change: Array  # [phase times row, lane], of z
    rest: Array  # [phase times watched, lane], what is added to the sums
    since: Array  # [watched, lane], phase from which its peak is taken
    samples: Array  # [sample, lane], s, the same in all lanes
    taken: Integers  # [lane], samples
    clock: Array  # [2, lane]: length of a step, s; their number in the phase
    z: Array  # [row, lane]
    moved: Array  # [row, lane], z behind the step
    Gh: Array  # [entry, lane], over a step
    P: Array  # [row times size, lane]
    power: Array  # [row times size, lane]
    spare: Array  # [row times size, lane]
    slope: Array  # [sloped, lane], weights, over a step
    part: Array  # [4 times part, lane], see `measure` and `prepare`
    share: Array  # [watched times part, lane], of a part's size
    at: Array  # [4 times watched, lane], see `read` and `sizes`
    series: Array  # [term times watched, lane]
    above: Array  # [2 times watched, lane], bound of the last step
    kept: Array  # [2 times watched times row of a kept step, lane]
    # the greatest values so far, then those with the sign changed
    extreme: Array  # [2 times watched, lane]
    history: Array  # [sample times watched, lane]
    steps: Array  # [1, lane]


_INTEGERS = (
    "first_entry", "column", "first_summed", "summed", "first_sloped", "sloped",
    "product", "driven", "taken",
)  # fmt: skip
pack_type = types.BaseTuple.from_types(
    [integers if name in _INTEGERS else table for name in Pack._fields], Pack
)


@compiled(within=True)
def greater(a, b):
    """Return the greater of two; b where either is no number."""
    return np.where(a > b, a, b)


@compiled()
def measure(pack):
    """Fill how fast each part may turn and grow, 1/s, and its share in each sum.

    Norms of G by rows and columns bound its Euclidean one, and Gershgorin's circles of
    its symmetric part the growth of |z|.
    """
    m, watched = len(pack.z), len(pack.rest) // (len(pack.marks) - 1)
    size = len(pack.P) // m
    G, dense = rows(pack.G), rows(pack.power)
    part, share = rows(pack.part), rows(pack.share)
    marks = rows(pack.marks)
    nothing = 0.0 * marks[0]
    for i in range(m * size):
        dense[i] = nothing
    for i in range(m):
        for e in range(pack.first_entry[i], pack.first_entry[i + 1]):
            dense[i * size + pack.column[e] % size] = G[e]
    parts = m // size
    for k in range(parts):
        widest, highest, growth = nothing, nothing, nothing
        for i in range(size):
            width, height, grown = nothing, nothing, nothing
            for j in range(size):
                there = dense[(k * size + i) * size + j]
                back = dense[(k * size + j) * size + i]
                width, height = width + np.abs(there), height + np.abs(back)
                if i == j:
                    grown = grown + there
                else:
                    grown = grown + 0.5 * np.abs(there + back)
            widest, highest = greater(width, widest), greater(height, highest)
            growth = greater(grown, growth)
        part[k], part[parts + k] = np.sqrt(widest * highest), growth
        part[3 * parts + k] = np.exp(growth * (marks[len(marks) - 1] - marks[0]))
    weight = rows(pack.weight)
    for i in range(watched * parts):
        share[i] = nothing
    for o in range(watched):
        for e in range(pack.first_summed[o], pack.first_summed[o + 1]):
            i = o * parts + pack.summed[e] // size
            share[i] = share[i] + weight[e] * weight[e]
    for i in range(watched * parts):
        share[i] = np.sqrt(share[i])


@compiled()
def times(width, factor, pack):
    """Turn `power`, rows times width, into factor G h power."""
    m = len(pack.z)
    Gh, power, product = rows(pack.Gh), rows(pack.power), rows(pack.spare)
    for i in range(m):
        begin, end = pack.first_entry[i], pack.first_entry[i + 1]
        for k in range(width):
            total = 0.0 * Gh[0]
            for e in range(begin, end):
                total = total + Gh[e] * power[pack.column[e] * width + k]
            product[i * width + k] = total * factor
    for i in range(m * width):
        power[i] = product[i]


@compiled()
def scale(h, pack):
    """Fill G h."""
    G, Gh = rows(pack.G), rows(pack.Gh)
    for e in range(len(G)):
        Gh[e] = G[e] * h


@compiled()
def prepare(h, pack):
    """Fill what is the same in all steps of a phase: P = e^(G h), slopes, bounds."""
    m = len(pack.z)
    size = len(pack.P) // m
    Gh, P, power = rows(pack.Gh), rows(pack.P), rows(pack.power)
    slope, weight, part = rows(pack.slope), rows(pack.weight), rows(pack.part)
    scale(h, pack)
    for i in range(m * size):
        power[i] = 0.0 * h + (1.0 if i % size == i // size % size else 0.0)
        P[i] = power[i]
    for term in range(1, TERMS + 1):
        times(size, 1.0 / term, pack)
        for i in range(m * size):
            P[i] = P[i] + power[i]
    for i in range(len(slope)):
        slope[i] = 0.0 * h
    for i in range(0, len(pack.product), 3):
        j, e, of_G = pack.product[i], pack.product[i + 1], pack.product[i + 2]
        slope[j] = slope[j] + weight[e] * Gh[of_G]
    parts = m // size
    for k in range(parts):
        turn, growth = part[k] * h, part[parts + k]
        square = turn * turn
        often = np.exp(growth * (OFTEN * h))
        part[2 * parts + k] = square * square * often * (1.0 / 144.0)


@compiled()
def sizes(z, pack):
    """Fill M/144 of each sum for some steps, and what it may reach from now on."""
    m, watched = len(pack.z), len(pack.extreme) // 2
    size = len(pack.P) // m
    at, part, share = rows(pack.at), rows(pack.part), rows(pack.share)
    for i in range(2 * watched, 4 * watched):
        at[i] = 0.0 * z[0]
    parts = m // size
    for k in range(parts):
        square = z[k * size] * z[k * size]
        for i in range(k * size + 1, (k + 1) * size):
            square = square + z[i] * z[i]
        now = np.sqrt(square)
        sharp, later = now * part[2 * parts + k], now * part[3 * parts + k]
        for o in range(watched):
            i = o * parts + k
            at[2 * watched + o] = at[2 * watched + o] + share[i] * sharp
            at[3 * watched + o] = at[3 * watched + o] + share[i] * later


@compiled(within=True)
def read(o, phase, z, pack):
    """Return the value of a watched quantity, and its slope over a step."""
    weight, slope = rows(pack.weight), rows(pack.slope)
    watched = len(pack.extreme) // 2
    value, rate = rows(pack.rest)[phase * watched + o], 0.0 * z[0]
    for e in range(pack.first_summed[o], pack.first_summed[o + 1]):
        value = value + weight[e] * z[pack.summed[e]]
    for e in range(pack.first_sloped[o], pack.first_sloped[o + 1]):
        rate = rate + slope[e] * z[pack.sloped[e]]
    return value, rate


@compiled()
def expand(first, last, h, z, pack):
    """Fill the Taylor series of watched sums over a step, in shares of it."""
    watched = len(pack.extreme) // 2
    power, series, weight = rows(pack.power), rows(pack.series), rows(pack.weight)
    scale(h, pack)
    for i in range(len(z)):
        power[i] = z[i]
    for term in range(SERIES + 1):
        if term > 0:
            times(1, 1.0 / term, pack)
        for o in range(first, last):
            total = 0.0 * h
            for e in range(pack.first_summed[o], pack.first_summed[o + 1]):
                total = total + weight[e] * power[pack.summed[e]]
            series[term * watched + o] = total


@compiled()
def settle(row, here, pack):
    """Raise the greatest value of a row to the top of its kept step, where it is.

    The step is walked through: a stretch is done with once its bound is not above the
    greatest value; otherwise it is cut at the turn that Newton's method finds.
    """
    watched = len(pack.extreme) // 2
    length = len(pack.kept) // (2 * watched)
    series, extreme = rows(pack.series), rows(pack.extreme)
    kept = rows(pack.kept)[row * length : (row + 1) * length]
    o, sign = row % watched, 1.0 if row < watched else -1.0
    expand(o, o + 1, kept[STEP], kept[KEPT:], pack)
    series[o] = series[o] + kept[REST]
    M, whole = 0.0 * kept[STEP], 0.0 * kept[STEP]
    for term in range(SERIES + 1):
        c = series[term * watched + o] * sign
        series[term * watched + o] = c
        whole = whole + np.abs(c)
        M = M + np.abs(c) * (term * (term - 1) * (term - 2) * (term - 3) / 144.0)
    best = extreme[row]
    begin, a, a_ = 0.0 * M, series[o], series[watched + o]
    end = begin + 1.0
    for _ in range(ROUNDS):
        if not np.any(here):
            break
        b, b_, bend = 0.0 * M, 0.0 * M, 0.0 * M
        for term in range(SERIES, -1, -1):
            bend = bend * end + 2.0 * b_
            b_ = b_ * end + b
            b = b * end + series[term * watched + o]
        h = end - begin
        best = np.where(here, greater(b, best), best)
        middle = 0.5 * (a + b) + h * (a_ - b_) * (1.0 / 6.0) + M * (h * h) * (h * h)
        outer = greater(a + 0.25 * h * a_, b - 0.25 * h * b_)
        passed = greater(outer, middle) <= best + SAME * whole
        turn = end - b_ / bend
        cut = np.where((turn > begin) & (turn < end), turn, 0.5 * (begin + end))
        # a top just ahead is passed over closely
        past = 2.0 * turn - end
        ahead = np.where((past > end) & (past < 1.0), past, 1.0)
        begin = np.where(passed, end, begin)
        a, a_ = np.where(passed, b, a), np.where(passed, b_, a_)
        here = here & (begin < 1.0)
        end = np.where(passed, ahead, cut)
    extreme[row] = best


@compiled()
def keep(phase, h, running, z, pack):
    """Keep the step that may hold the top, for each row; settle others that may."""
    watched = len(pack.extreme) // 2
    length = len(pack.kept) // (2 * watched)
    above, extreme, rest = rows(pack.above), rows(pack.extreme), rows(pack.rest)
    for row in range(2 * watched):
        here = running & (above[row] > extreme[row])
        if not np.any(here):
            continue
        kept = rows(pack.kept)[row * length : (row + 1) * length]
        open_ = here & (kept[BOUND] > extreme[row])
        if np.any(open_):
            settle(row, open_, pack)
        kept[BOUND] = np.where(here, above[row], kept[BOUND])
        kept[STEP] = np.where(here, h, kept[STEP])
        now = rest[phase * watched + row % watched]
        kept[REST] = np.where(here, now, kept[REST])
        for i in range(len(z)):
            kept[KEPT + i] = np.where(here, z[i], kept[KEPT + i])


@compiled(within=True)
def take_peaks(phase, running, moved, pack):
    """Raise the greatest values by the end of a step, and return where more may be."""
    watched = len(pack.extreme) // 2
    at, above, extreme = rows(pack.at), rows(pack.above), rows(pack.extreme)
    more = running & ~running
    for o in range(watched):
        a, a_, M = at[o], at[watched + o], at[2 * watched + o]
        b, b_ = read(o, phase, moved, pack)
        first, middle, third = a + 0.25 * a_, 0.5 * (a + b), b - 0.25 * b_
        middle = middle + (a_ - b_) * (1.0 / 6.0)
        top = greater(greater(first, third), middle + M)
        bottom = greater(greater(-first, -third), M - middle)
        high, low = greater(b, extreme[o]), greater(-b, extreme[watched + o])
        more = more | (top > high) | (bottom > low)
        at[o], at[watched + o] = b, b_
        above[o], above[watched + o] = top, bottom
        extreme[o], extreme[watched + o] = high, low
    return more & running


@compiled()
def take_samples(phase, step, z, pack):
    """Store the watched quantities at the sample times of a step."""
    watched, expanded = len(pack.extreme) // 2, False
    for lane in range(WIDTH):
        if not step < pack.clock[1, lane]:
            continue
        h = pack.clock[0, lane]
        t = pack.marks[phase, lane] + step * h
        while pack.taken[lane] < len(pack.samples):
            sample = pack.taken[lane]
            share = (pack.samples[sample, lane] - t) / h
            if not share <= 1.0 + LATE:
                break
            if not expanded:
                expand(0, watched, rows(pack.clock)[0], z, pack)
                expanded = True
            for o in range(watched):
                value = 0.0
                for term in range(SERIES, -1, -1):
                    value = value * share + pack.series[term * watched + o, lane]
                rest = pack.rest[phase * watched + o, lane]
                pack.history[sample * watched + o, lane] = value + rest
            pack.taken[lane] += 1


@compiled(within=True)
def advance(running, z, moved, pack):
    """Fill P z where trials run."""
    m = len(z)
    size, P = len(pack.P) // m, rows(pack.P)
    for first in range(0, m, size):
        for i in range(first, first + size):
            total = P[i * size] * z[first]
            for j in range(1, size):
                total = total + P[i * size + j] * z[first + j]
            moved[i] = np.where(running, total, z[i])


@compiled(within=True)
def over(phase, pack):
    """Return where no later step of the phase can raise a greatest value."""
    watched = len(pack.extreme) // 2
    at, extreme, rest = rows(pack.at), rows(pack.extreme), rows(pack.rest)
    done = extreme[0] == extreme[0]
    for o in range(watched):
        middle, bound = rest[phase * watched + o], at[3 * watched + o]
        done = done & (middle + bound <= extreme[o])
        done = done & (bound - middle <= extreme[watched + o])
    return done


@compiled(types.void(pack_type))
def follow(pack):
    """Follow the trials of a pack from the first mark to the last."""
    m, watched, phases = len(pack.z), len(pack.extreme) // 2, len(pack.marks) - 1
    size = len(pack.P) // m
    length = len(pack.kept) // (2 * watched)
    z, moved = rows(pack.z), rows(pack.moved)
    change, at, since = rows(pack.change), rows(pack.at), rows(pack.since)
    marks, clock, steps = rows(pack.marks), rows(pack.clock), rows(pack.steps)
    extreme, kept, part = rows(pack.extreme), rows(pack.kept), rows(pack.part)
    for i in range(m):
        z[i] = 0.0 * marks[0]
    measure(pack)
    fastest = part[0]
    for k in range(1, m // size):
        fastest = greater(part[k], fastest)
    total = 0.0 * fastest
    for phase in range(phases):
        total = total - np.floor((marks[phase] - marks[phase + 1]) * fastest / A_STEP)
    few = total <= MOST_STEPS
    steps[0] = np.where(few, 0.0, total)
    searched = few
    clock[0], clock[1] = 0.0 * total, 0.0 * total
    for phase in range(phases):
        for i in range(m):
            jump = change[phase * m + i]
            z[i] = z[i] + jump if i % size < size - pack.driven[0] else jump
        span = marks[phase + 1] - marks[phase]
        count = greater(-np.floor(-span * fastest / A_STEP), 0.0 * span + 1.0)
        count = np.where(few & (span > 0.0), count, 0.0)
        if not np.any(count > 0.0):
            continue
        h = span / greater(count, 0.0 * span + 1.0)
        if np.any(h != clock[0]):  # equal phases in a row share P
            clock[0] = h
            prepare(h, pack)
        clock[1] = count
        for o in range(watched):
            b, b_ = read(o, phase, z, pack)
            at[o], at[watched + o] = b, b_
            fresh = since[o] >= float(phase)
            for row in range(o, 2 * watched, watched):
                side = b if row == o else -b
                now = np.where(fresh, -np.inf, extreme[row])
                bound = rows(pack.kept)[row * length + BOUND]
                extreme[row] = np.where(count > 0.0, greater(side, now), now)
                kept[row * length + BOUND] = np.where(fresh, -np.inf, bound)
        step = 0
        running = count > 0.0
        while np.any(running):
            if step % OFTEN == 0:
                sizes(z, pack)
                if phase == phases - 1:
                    searched = searched & ~over(phase, pack)
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
    for row in range(2 * watched):
        here = kept[row * length + BOUND] > extreme[row]
        if np.any(here):
            settle(row, here, pack)
