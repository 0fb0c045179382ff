"""Branch-free exp of a vector, at most 2 ulp, and of a number in two doubles."""

from __future__ import annotations

import numpy as np
from numba.extending import overload, register_jitable

from tolstat.lanes.binary import WHOLE, times_power
from tolstat.lanes.elementary import multiply_add
from tolstat.lanes.logarithm import LN2_A, LN2_B
from tolstat.lanes.vector import vector

STRICT = {"fastmath": False}
PER_LN2 = 1.4426950408889634
# outside, the result is 0 or infinite
LOWEST, HIGHEST = -750.0, 715.0


@register_jitable(**STRICT)
def exp_of_two(x, x_lost):
    """Return e^(x + x_lost), x_lost a correction that x cannot hold.

    x + x_lost = n ln 2 + r, |r| <= ln 2/2; e^r = 1 + r + r^2 Q(r), Q a Chebyshev fit of
    10 terms, error 1e-17 of e^r.
    """
    near = np.minimum(np.maximum(x, LOWEST), HIGHEST)
    turns = multiply_add(near, PER_LN2, WHOLE)
    n = turns - WHOLE
    # n LN2_A is exact, and so is the difference
    a = multiply_add(-n, LN2_A, near)
    b = multiply_add(-n, LN2_B, np.where(near == x, x_lost, 0.0))
    r = a + b
    u = r * r
    # two interleaved Horner chains: half the waiting
    even = multiply_add(u, 2.7620088445409746e-07, 2.4801521295954376e-05)
    odd = multiply_add(u, 2.510038549551032e-08, 2.7557268459997064e-06)
    even = multiply_add(u, even, 0.0013888888917213717)
    odd = multiply_add(u, odd, 0.00019841269863053618)
    even = multiply_add(u, even, 0.04166666666662413)
    odd = multiply_add(u, odd, 0.008333333333330062)
    even = multiply_add(u, even, 0.5)
    odd = multiply_add(u, odd, 0.16666666666666669)
    q = multiply_add(r, odd, even)
    # with the rounding error of r
    rest = multiply_add(u, q, b - (r - a))
    return times_power(1.0 + (r + rest), turns)


@overload(np.exp, jit_options=STRICT)
def exp(x):
    """Return e^x; infinities, NaN and subnormal results as NumPy."""
    if x is not vector:
        return None
    return lambda x: exp_of_two(x, 0.0)
