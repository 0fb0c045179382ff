"""Steps of linear equations, exact but for rounding, a trial in each lane.

z' = G z within a phase, so z(t + h) = P z(t) with P = e^(G h), the same in all its
steps. Between steps the solution is its Taylor series: that gives peaks and samples.
The rows of z are positions, their rates, and what drives them. Each phase adds to the
first two what jumps, and sets the last.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import types

from tolstat.arrays import Array, Integers
from tolstat.integrator.linear_motion import SERIES, TERMS
from tolstat.integrator.signatures import integers, table
from tolstat.lanes.compiled import compiled
from tolstat.lanes.rows import rows
from tolstat.lanes.vector import WIDTH

LOOKS = 8  # points of a step between which a peak is looked for
ROUNDS = 60  # of Newton and bisection, at most
REACH = 0.6  # a parabola rises by half a step times its steeper slope, at most
LATE = 1e-9  # of a step: what rounding may put a sample behind the last mark


class Pack(NamedTuple):
    """Trials in lanes, and room for their steps."""

    # entries of G that are not zero in all trials, by rows: the first of each row and
    # behind all, their columns; the same of the positions that a watched sum adds up
    first_entry: Integers
    column: Integers
    first_summed: Integers
    summed: Integers
    G: Array  # [entry, lane], 1/s
    Gh: Array  # [entry, lane], over a step
    begin: Array  # [phase, lane], s
    h: Array  # [phase, lane], s
    steps: Array  # [phase, lane]
    change: Array  # [phase times row, lane], of z
    rest: Array  # [phase times watched, lane], what is added to the sums
    since: Array  # [watched, lane], phase from which its peak is taken
    samples: Array  # [sample, lane], s, the same in all lanes
    taken: Integers  # [lane], samples
    z: Array  # [row, lane]
    moved: Array  # [row, lane], z behind the step
    wanted: Array  # [watched, lane], where a peak is looked for
    P: Array  # [row times row, lane]
    power: Array  # [row times row, lane]
    product: Array  # [row times row, lane]
    series: Array  # [term times position, lane]
    at: Array  # [4 times watched, lane], values and slopes before and behind a step
    greatest: Array  # [watched, lane]
    least: Array  # [watched, lane]
    history: Array  # [sample times watched, lane]


_INTEGERS = "first_entry", "column", "first_summed", "summed", "taken"
pack_type = types.BaseTuple.from_types(
    [integers if name in _INTEGERS else table for name in Pack._fields], Pack
)


@compiled()
def times(width, factor, pack):
    """Turn `power`, rows times width, into factor G h power."""
    m = len(pack.z)
    Gh, power, product = rows(pack.Gh), rows(pack.power), rows(pack.product)
    for i in range(m):
        begin, end = pack.first_entry[i], pack.first_entry[i + 1]
        for k in range(0, width - 3, 4):  # these sums do not wait for each other
            one = two = three = four = 0.0 * Gh[0]
            for e in range(begin, end):
                at = pack.column[e] * width + k
                one = one + Gh[e] * power[at]
                two = two + Gh[e] * power[at + 1]
                three = three + Gh[e] * power[at + 2]
                four = four + Gh[e] * power[at + 3]
            at = i * width + k
            product[at], product[at + 1] = one * factor, two * factor
            product[at + 2], product[at + 3] = three * factor, four * factor
        for k in range(width - width % 4, width):
            total = 0.0 * Gh[0]
            for e in range(begin, end):
                total = total + Gh[e] * power[pack.column[e] * width + k]
            product[i * width + k] = total * factor
    for i in range(m * width):
        power[i] = product[i]


@compiled()
def propagator(h, pack):
    """Fill G h and P = e^(G h) of all lanes."""
    m = len(pack.z)
    G, Gh, P, power = rows(pack.G), rows(pack.Gh), rows(pack.P), rows(pack.power)
    for e in range(len(G)):
        Gh[e] = G[e] * h
    for i in range(m * m):
        power[i] = 0.0 * h + (1.0 if i % (m + 1) == 0 else 0.0)
        P[i] = power[i]
    for term in range(1, TERMS + 1):
        times(m, 1.0 / term, pack)
        for i in range(m * m):
            P[i] = P[i] + power[i]


@compiled()
def expand(pack):
    """Fill the Taylor series of all positions over the step, in shares of it."""
    n = len(pack.series) // (SERIES + 1)
    z, power, series = rows(pack.z), rows(pack.power), rows(pack.series)
    for i in range(len(z)):
        power[i] = z[i]
    for i in range(n):
        series[i] = z[i]
    for term in range(1, SERIES + 1):
        times(1, 1.0 / term, pack)
        for i in range(n):
            series[term * n + i] = power[i]


@compiled(within=True)
def read(phase, first, z, pack):
    """Fill values of the watched quantities, from row `first`, and slopes behind."""
    n, watched = len(pack.series) // (SERIES + 1), len(pack.greatest)
    Z, at, rest = rows(z), rows(pack.at), rows(pack.rest)
    for o in range(watched):
        begin, end = pack.first_summed[o], pack.first_summed[o + 1]
        value, slope = Z[pack.summed[begin]], Z[n + pack.summed[begin]]
        for each in range(begin + 1, end):
            value = value + Z[pack.summed[each]]
            slope = slope + Z[n + pack.summed[each]]
        at[first + o] = value + rest[phase * watched + o]
        at[first + watched + o] = slope


@compiled()
def of_series(o, lane, share, pack):
    """Return a watched sum, its slope and its bend at a share of the step."""
    n = len(pack.series) // (SERIES + 1)
    value, slope, bend = 0.0, 0.0, 0.0
    for term in range(SERIES, -1, -1):
        c = 0.0
        for each in range(pack.first_summed[o], pack.first_summed[o + 1]):
            c += pack.series[term * n + pack.summed[each], lane]
        bend = bend * share + 2.0 * slope
        slope = slope * share + value
        value = value * share + c
    return value, slope, bend


@compiled()
def refine(phase, o, lane, pack):
    """Take the peaks of a watched quantity inside the step, where its slope is zero."""
    rest = pack.rest[phase * len(pack.greatest) + o, lane]
    left = 0.0
    _, slope, _ = of_series(o, lane, left, pack)
    for look in range(1, LOOKS + 1):
        right = look / LOOKS
        _, next_slope, _ = of_series(o, lane, right, pack)
        if slope * next_slope < 0.0:
            low, high, share = left, right, 0.5 * (left + right)
            for _ in range(ROUNDS):
                _, there, bend = of_series(o, lane, share, pack)
                if there * slope > 0.0:
                    low = share
                else:
                    high = share
                after = share - there / bend
                if not (low < after < high):
                    after = 0.5 * (low + high)
                if abs(after - share) < 1e-12:
                    break
                share = after
            value, _, _ = of_series(o, lane, share, pack)
            value += rest
            pack.greatest[o, lane] = max(pack.greatest[o, lane], value)
            pack.least[o, lane] = min(pack.least[o, lane], value)
        left, slope = right, next_slope


@compiled()
def take_samples(phase, step, pack):
    """Store the watched quantities at the sample times of a step."""
    watched, expanded = len(pack.greatest), False
    n = len(pack.series) // (SERIES + 1)
    for lane in range(WIDTH):
        if not step < pack.steps[phase, lane]:
            continue
        h = pack.h[phase, lane]
        t = pack.begin[phase, lane] + step * h
        while pack.taken[lane] < len(pack.samples):
            sample = pack.taken[lane]
            share = (pack.samples[sample, lane] - t) / h
            if share > 1.0 + LATE:
                break
            if not expanded:
                expand(pack)
                expanded = True
            for o in range(watched):
                value = 0.0
                for term in range(SERIES, -1, -1):
                    value *= share
                    for i in range(pack.first_summed[o], pack.first_summed[o + 1]):
                        value += pack.series[term * n + pack.summed[i], lane]
                rest = pack.rest[phase * watched + o, lane]
                pack.history[sample * watched + o, lane] = value + rest
            pack.taken[lane] += 1


@compiled(within=True)
def take_peaks(phase, h, running, pack):
    """Raise the greatest and lower the least values by a step."""
    watched = len(pack.greatest)
    at, since, wanted = rows(pack.at), rows(pack.since), rows(pack.wanted)
    greatest, least = rows(pack.greatest), rows(pack.least)
    some = running & ~running
    for o in range(watched):
        a, a_ = at[o], at[watched + o]
        b, b_ = at[2 * watched + o], at[3 * watched + o]
        taking = running & (since[o] <= float(phase))
        high, low = np.maximum(a, b), np.minimum(a, b)
        top = np.maximum(greatest[o], high)
        bottom = np.minimum(least[o], low)
        greatest[o] = np.where(taking, top, greatest[o])
        least[o] = np.where(taking, bottom, least[o])
        # the slope in the middle, by the cubic through both ends
        middle = 6.0 * (b - a) - h * (a_ + b_)
        turns = (a_ * b_ < 0.0) | (middle * a_ < 0.0)
        reach = REACH * h * np.maximum(np.abs(a_), np.abs(b_))
        here = taking & turns & ((high + reach > top) | (low - reach < bottom))
        wanted[o] = np.where(here, 1.0, 0.0)
        some = some | here
    if np.any(some):
        expand(pack)
        for o in range(watched):
            for lane in range(WIDTH):
                if pack.wanted[o, lane] > 0.0:
                    refine(phase, o, lane, pack)


@compiled(within=True)
def advance(pack):
    """Fill P z, four rows at a time: their sums do not wait for each other."""
    m = len(pack.z)
    z, moved, P = rows(pack.z), rows(pack.moved), rows(pack.P)
    for i in range(0, m - 3, 4):
        a, b, c, d = (i + 0) * m, (i + 1) * m, (i + 2) * m, (i + 3) * m
        one, two, three, four = P[a] * z[0], P[b] * z[0], P[c] * z[0], P[d] * z[0]
        for j in range(1, m):
            one = one + P[a + j] * z[j]
            two = two + P[b + j] * z[j]
            three = three + P[c + j] * z[j]
            four = four + P[d + j] * z[j]
        moved[i], moved[i + 1], moved[i + 2], moved[i + 3] = one, two, three, four
    for i in range(m - m % 4, m):
        one = P[i * m] * z[0]
        for j in range(1, m):
            one = one + P[i * m + j] * z[j]
        moved[i] = one


@compiled(types.void(pack_type))
def follow(pack):
    """Follow the trials of a pack from the first mark to the last."""
    m, n, watched = len(pack.z), len(pack.series) // (SERIES + 1), len(pack.greatest)
    z, moved = rows(pack.z), rows(pack.moved)
    change, at = rows(pack.change), rows(pack.at)
    for phase in range(len(pack.steps)):
        for i in range(m):
            jump = change[phase * m + i]
            z[i] = z[i] + jump if i < 2 * n else jump
        longest = 0.0
        for lane in range(WIDTH):
            longest = max(longest, pack.steps[phase, lane])
        if longest == 0.0:
            continue
        h, count = rows(pack.h)[phase], rows(pack.steps)[phase]
        other = phase == 0
        for lane in range(WIDTH):
            other |= pack.h[phase, lane] != pack.h[max(phase - 1, 0), lane]
            other |= pack.steps[max(phase - 1, 0), lane] == 0.0
        if other:  # equal phases in a row share their P
            propagator(h, pack)
        read(phase, 0, pack.z, pack)
        for step in range(int(longest)):
            running = count > float(step)
            advance(pack)
            read(phase, 2 * watched, pack.moved, pack)
            take_peaks(phase, h, running, pack)
            if len(pack.samples) > 0:
                take_samples(phase, step, pack)
            for i in range(m):
                z[i] = np.where(running, moved[i], z[i])
            for o in range(2 * watched):
                at[o] = at[2 * watched + o]
