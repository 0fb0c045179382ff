"""Linear motion in lanes: trials packed for their steps, and the search for peaks.

A watched quantity x is a sum of positions. Its values and slopes at both ends of a step
give a cubic. At a share s of the step that errs by s^2 (1 - s)^2/24 times the fourth
derivative of x by s, which is at most 144 M. So x lies below a polynomial in
Bernstein's form, and this below its greatest coefficient: no peak is passed over that
is higher by more than the error that `linear_motion.solve` states.
"""

from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array, Integers
from tolstat.integrator.signatures import integer, integers, tuple_type
from tolstat.lanes.compiled import compiled
from tolstat.lanes.vector import WIDTH

SERIES = 17  # terms of the solution inside a step: (pi/2)^18/18! = 5e-13 at its end
LOOK_EVERY = 8  # steps between two looks at the sizes of the parts
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
def times(width, factor, power, product, pack):
    """Fill the next term of Taylor series, rows times width: factor G h power."""
    G, length = pack.G, pack.length
    for i in range(len(pack.z) * width):
        product[i] = 0.0 * length[0]
    for e in range(len(G)):
        to, source, G_ = pack.row[e] * width, pack.column[e] * width, factor * G[e]
        for k in range(width):
            product[to + k] = product[to + k] + G_ * length[k] * power[source + k]


@compiled(within=True)
def read(o, n, rest, z, pack):
    """Return the value of a watched quantity, and its slope over a step."""
    weight, slope = pack.weight, pack.slope
    value, rate = rest, 0.0 * z[0]
    for i in range(n):
        value = value + weight[o * n + i] * z[i]
        rate = rate + slope[o * n + i] * z[n + i]
    return value, rate


MOST_STEPS = 20_000_000  # of a trial
SAME = 1e-14  # of a watched quantity: as high
ROUNDS = 10_000  # of a search, at most: 20 are usual; a trial that needs more fails
LATE = 1e-9  # of a step: what rounding may put a sample behind the last mark


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
            sharp[o] = sharp[o] + part_share * soon
            reach[o] = reach[o] + part_share * ever


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
            first_weight = row % watched * n
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
    magnitude = 0.0 * series[row]
    for term in range(SERIES + 1):
        magnitude = magnitude + np.abs(series[term * 2 * watched + row])
    begin, a, a_ = 0.0 * magnitude, series[row], series[2 * watched + row]
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
        passed = greater(outer, middle) <= best + SAME * magnitude
        turn = end - b_ / bend
        # a turn that is reached gains nothing: only halves then get on
        gains = np.abs(b_ * (end - turn)) > SAME * magnitude
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
        offset = rest[phase * watched + row % watched]
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
