"""Steps of linear equations by e^(G h), a trial in each lane.

z' = G z within a phase, so z(t + h) = P z(t) with P = e^(G h), the same in all its
steps. A watched quantity x is a sum of positions. Its values and slopes at both ends of
a step give a cubic. At a share s of the step that errs by s^2 (1 - s)^2/24 times the
fourth derivative of x by s, which is at most 144 M. So x lies below a polynomial in
Bernstein's form, and this below its greatest coefficient: no peak is passed over that
is higher by more than the error that `linear_motion.solve` states.
"""

from typing import NamedTuple

import numpy as np
from numba import types

from tolstat.arrays import Array, Integers
from tolstat.integrator.signatures import integer, integers, tuple_type
from tolstat.lanes.compiled import compiled
from tolstat.lanes.rows import rows
from tolstat.lanes.vector import WIDTH

MOST_TURN = 0.5 * np.pi  # of the fastest part in a step
MOST_STEPS = 20_000_000  # of a trial
TERMS = 24  # of e^(G h), which thousands of steps multiply: (pi/2)^25/25! = 5e-21
SERIES = 17  # terms of the solution inside a step: (pi/2)^18/18! = 5e-13 at its end
LOOK_EVERY = 8  # steps between two looks at the sizes of the parts
SAME = 1e-14  # of a watched quantity: as high
ROUNDS = 10_000  # of a search, at most: 20 are usual; a trial that needs more fails
LATE = 1e-9  # of a step: what rounding may put a sample behind the last mark
STEP, REST, BOUND, KEPT = range(4)  # rows of a kept step, then z before it


class Pack(NamedTuple):
    """Trials in lanes, and room for their steps."""

    row: Integers  # of the entries of G that are not zero in all trials
    column: Integers
    taken: Integers  # [lane], samples
    parts: int
    driven: int  # rows
    marks: Array  # [mark, lane], s
    G: Array  # [entry, lane], 1/s
    change: Array  # [phase times row, lane], of z
    weight: Array  # [watched times position, lane]
    rest: Array  # [phase times watched, lane], what is added to the sums
    since: Array  # [watched, lane], phase from which its peak is taken
    samples: Array  # [sample, lane], s, the same in all lanes
    clock: Array  # [2, lane]: length of a step, s; their number in the phase
    z: Array  # [row, lane]
    moved: Array  # [row, lane], z behind the step
    P: Array  # [row times size of a part, lane]
    power: Array  # [row times column, lane], of a Taylor series
    product: Array  # [row times column, lane]
    length: Array  # [column, lane], s, of its step
    slope: Array  # [watched times position, lane], weights of the rates over a step
    turn: Array  # [part, lane], 1/s, fastest of |z| of a part
    growth: Array  # [part, lane], 1/s
    soon: Array  # [part, lane], how |z| grows over `LOOK_EVERY` steps, over 144
    ever: Array  # [part, lane], over all
    share: Array  # [watched times part, lane], of a part's size
    value: Array  # [watched, lane], at the begin of a step
    rate: Array  # [watched, lane], over the step
    sharp: Array  # [watched, lane], M for some steps
    reach: Array  # [watched, lane], how far from rest it may ever come
    series: Array  # [term times 2 times watched, lane]
    above: Array  # [2 times watched, lane], bound of the last step
    candidates: Array  # [2 times watched times row of a kept step, lane]
    # the greatest values so far, then those with the sign changed
    extreme: Array  # [2 times watched, lane]
    history: Array  # [sample times watched, lane]
    steps: Array  # [1, lane]


pack_type = tuple_type(
    Pack, row=integers, column=integers, taken=integers, parts=integer, driven=integer
)


@compiled(within=True)
def greater(a, b):
    """Return the greater of two; b where either is no number."""
    return np.where(a > b, a, b)


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
def times(width, factor, power, product, pack):
    """Fill the next term of Taylor series, rows times width: factor G h power."""
    G, length = pack.G, pack.length
    for i in range(len(pack.z) * width):
        product[i] = 0.0 * length[0]
    for e in range(len(G)):
        to, source, G_ = pack.row[e] * width, pack.column[e] * width, factor * G[e]
        for k in range(width):
            product[to + k] = product[to + k] + G_ * length[k] * power[source + k]


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


@compiled()
def sizes(z, pack):
    """Fill M of each sum for some steps, and how far from rest it may ever come.

    All derivatives of z follow the equations of z, and so do bounds of their growth.
    """
    parts, watched = pack.parts, len(pack.since)
    share, sharp, reach = pack.share, pack.sharp, pack.reach
    fourth, product = pack.power, pack.product
    pack.length[0] = pack.clock[0]
    for i in range(len(z)):
        fourth[i] = z[i]
    for _ in range(4):
        times(1, 1.0, fourth, product, pack)
        fourth, product = product, fourth
    for o in range(watched):
        sharp[o] = reach[o] = 0.0 * z[0]
    for k in range(parts):
        square, bend = 0.0 * z[0], 0.0 * z[0]
        for i in range(k, len(z), parts):
            square, bend = square + z[i] * z[i], bend + fourth[i] * fourth[i]
        ever, soon = np.sqrt(square) * pack.ever[k], np.sqrt(bend) * pack.soon[k]
        for o in range(watched):
            part_share = share[o * parts + k]
            sharp[o], reach[o] = (
                sharp[o] + part_share * soon,
                reach[o] + part_share * ever,
            )


@compiled(within=True)
def read(o, n, rest, z, pack):
    """Return the value of a watched quantity, and its slope over a step."""
    weight, slope = pack.weight, pack.slope
    value, rate = rest, 0.0 * z[0]
    for i in range(n):
        value = value + weight[o * n + i] * z[i]
        rate = rate + slope[o * n + i] * z[n + i]
    return value, rate


@compiled()
def expand(first, last, width, pack):
    """Fill the Taylor series of rows over their steps.

    Their states are in the columns of `power`: one for each row, or one for all.
    """
    watched = len(pack.since)
    n = len(pack.weight) // watched
    series, weight = pack.series, pack.weight
    power, product = pack.power, pack.product
    for term in range(SERIES + 1):
        for row in range(first, last):
            first_weight = (row if row < watched else row - watched) * n
            column = row - first if width > 1 else 0
            total = weight[first_weight] * power[column]
            for i in range(1, n):
                total = total + weight[first_weight + i] * power[i * width + column]
            series[term * 2 * watched + row] = total
        times(width, 1.0 / (term + 1), power, product, pack)
        power, product = product, power


@compiled()
def climb(row, active, pack):
    """Raise the greatest value of a row to the top of its step, where it is.

    The step is walked through: a stretch is done with once its bound is not above the
    greatest value; otherwise it is cut at the turn that Newton's method finds.
    """
    watched, series = len(pack.since), pack.series
    integer = 0.0 * series[row]
    for term in range(SERIES + 1):
        integer = integer + np.abs(series[term * 2 * watched + row])
    begin, a, a_ = 0.0 * integer, series[row], series[2 * watched + row]
    end, best = begin + 1.0, pack.extreme[row]
    for _ in range(ROUNDS):
        if not np.any(active):
            break
        b, b_, bend, M = 0.0 * end, 0.0 * end, 0.0 * end, 0.0 * end
        for term in range(SERIES, 3, -1):  # M up to the end of the stretch
            c = np.abs(series[term * 2 * watched + row])
            power = term * (term - 1) * (term - 2) * (term - 3) / 144.0
            M = M * end + c * power
        for term in range(SERIES, -1, -1):
            bend = bend * end + 2.0 * b_
            b_ = b_ * end + b
            b = b * end + series[term * 2 * watched + row]
        h = end - begin
        best = np.where(active, greater(b, best), best)
        middle = 0.5 * (a + b) + h * (a_ - b_) * (1.0 / 6.0) + M * (h * h) * (h * h)
        outer = greater(a + 0.25 * h * a_, b - 0.25 * h * b_)
        passed = greater(outer, middle) <= best + SAME * integer
        turn = end - b_ / bend
        # a turn that is reached gains nothing: only halves then get on
        gains = np.abs(b_ * (end - turn)) > SAME * integer
        inside = (turn > begin) & (turn < end) & gains
        cut = np.where(inside, turn, 0.5 * (begin + end))
        # a top just ahead is passed over closely
        past = 2.0 * turn - end
        ahead = np.where((past > end) & (past < 1.0), past, 1.0)
        begin = np.where(passed, end, begin)
        a, a_ = np.where(passed, b, a), np.where(passed, b_, a_)
        active = active & (begin < 1.0)
        end = np.where(passed, ahead, cut)
    pack.extreme[row] = best
    pack.steps[0] = np.where(active, MOST_STEPS + 1.0, pack.steps[0])


@compiled()
def settle(first, last, pack):
    """Fill the series of some rows over their kept steps."""
    watched, m, width = len(pack.since), len(pack.z), last - first
    series, candidates = pack.series, pack.candidates
    length, power = pack.length, pack.power
    for row in range(first, last):
        start, sign = row * (KEPT + m), 1.0 if row < watched else -1.0
        length[row - first] = candidates[start + STEP]
        for i in range(m):
            power[i * width + row - first] = sign * candidates[start + KEPT + i]
    expand(first, last, width, pack)
    for row in range(first, last):
        rest = candidates[row * (KEPT + m) + REST]
        series[row] = series[row] + (rest if row < watched else -rest)


@compiled()
def keep(phase, h, running, z, pack):
    """Keep the step that may hold the top, for each row; settle others that may."""
    watched, m = len(pack.since), len(z)
    above, extreme, rest = pack.above, pack.extreme, pack.rest
    for row in range(2 * watched):
        active = running & (above[row] > extreme[row])
        if not np.any(active):
            continue
        candidate = pack.candidates[row * (KEPT + m) : (row + 1) * (KEPT + m)]
        other = active & (candidate[BOUND] > extreme[row])
        if np.any(other):
            settle(row, row + 1, pack)
            climb(row, other, pack)
        offset = rest[phase * watched + (row if row < watched else row - watched)]
        candidate[BOUND] = np.where(active, above[row], candidate[BOUND])
        candidate[STEP] = np.where(active, h, candidate[STEP])
        candidate[REST] = np.where(active, offset, candidate[REST])
        for i in range(m):
            candidate[KEPT + i] = np.where(active, z[i], candidate[KEPT + i])


@compiled(within=True)
def take_peaks(phase, running, moved, pack):
    """Raise the greatest values by the end of a step, and return where more may be."""
    watched, rest = len(pack.since), pack.rest
    n = len(pack.weight) // watched
    value, rate, above, extreme = pack.value, pack.rate, pack.above, pack.extreme
    more = running & ~running
    for o in range(watched):
        a, a_, M = value[o], rate[o], pack.sharp[o]
        b, b_ = read(o, n, rest[phase * watched + o], moved, pack)
        first, middle, third = a + 0.25 * a_, 0.5 * (a + b), b - 0.25 * b_
        middle = middle + (a_ - b_) * (1.0 / 6.0)
        top = greater(greater(first, third), middle + M)
        bottom = greater(greater(-first, -third), M - middle)
        high, low = greater(b, extreme[o]), greater(-b, extreme[watched + o])
        more = more | (top > high) | (bottom > low)
        value[o], rate[o] = b, b_
        above[o], above[watched + o] = top, bottom
        extreme[o], extreme[watched + o] = high, low
    return more & running


@compiled()
def take_samples(phase, step, z, pack):
    """Store the watched quantities at the sample times of a step."""
    watched, expanded = len(pack.since), False
    for lane in range(WIDTH):
        if not step < pack.clock[1, lane]:
            continue
        h = pack.clock[0, lane]
        t = pack.marks[phase, lane] + step * h
        while pack.taken[lane] < len(pack.samples):
            sample = pack.taken[lane]
            share = (pack.samples[sample, lane] - t) / h
            if share > 1.0 + LATE:
                break
            if not expanded:
                pack.length[0] = pack.clock[0]
                for i in range(len(z)):
                    pack.power[i] = z[i]
                expand(0, watched, 1, pack)
                expanded = True
            for o in range(watched):
                value = 0.0
                for term in range(SERIES, -1, -1):
                    value = value * share + pack.series[term * 2 * watched + o, lane]
                rest = pack.rest[phase * watched + o, lane]
                pack.history[sample * watched + o, lane] = value + rest
            pack.taken[lane] += 1


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


@compiled(within=True)
def is_over(phase, pack):
    """Return where no later step of the phase can raise a greatest value."""
    watched = len(pack.since)
    extreme, rest = pack.extreme, pack.rest
    done = extreme[0] == extreme[0]
    for o in range(watched):
        middle, bound = rest[phase * watched + o], pack.reach[o]
        done = done & (middle + bound <= extreme[o])
        done = done & (bound - middle <= extreme[watched + o])
    return done


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
