"""Trials that move linearly, packed into lanes, with room for their steps."""

from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array, Integers
from tolstat.integrator.signatures import integer, integers, tuple_type
from tolstat.lanes.compiled import compiled

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
