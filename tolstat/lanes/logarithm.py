"""Branch-free log of a vector, at most 2 ulp; in two doubles for powers."""

from __future__ import annotations

import numpy as np
from numba.extending import overload, register_jitable

from tolstat.lanes.binary import (
    WHOLE,
    exponent_of,
    fast_two_sum,
    significand_of,
    two_product,
)
from tolstat.lanes.elementary import multiply_add
from tolstat.lanes.vector import vector

STRICT = {"fastmath": False}
SMALLEST_NORMAL = 2.2250738585072014e-308
TWO_54 = 18014398509481984.0
# ln 2 in two parts; the first has 42 bits, so that k of them are exact
LN2_A = 0.6931471805598903
LN2_B = 5.497923018708371e-14
# 2/3 likewise
TWO_THIRDS_A = 0.6666666666666666
TWO_THIRDS_B = 3.700743415417188e-17


@register_jitable(**STRICT)
def _log_near_one(m):
    """Return log m in two doubles, m from sqrt(1/2) to sqrt(2); off by 2^-66 of itself.

    log m = 2 atanh s = 2 s + 2/3 s^3 + s^5 A(s^2), s = (m - 1)/(m + 1): the first two
    terms in two doubles, A a Chebyshev fit of 8 terms, error 2e-18.
    """
    f = m - 1.0
    d = m + 1.0
    d_lost = m - (d - 1.0)
    per_d = 1.0 / d
    s = f * per_d
    s_lost = (multiply_add(-s, d, f) - s * d_lost) * per_d
    u, u_lost = two_product(s, s)
    u_lost = multiply_add(2.0 * s, s_lost, u_lost)
    v, v_lost = two_product(u, s)
    v_lost = v_lost + multiply_add(u_lost, s, u * s_lost)
    t, t_lost = two_product(TWO_THIRDS_A, v)
    t_lost = t_lost + multiply_add(TWO_THIRDS_A, v_lost, TWO_THIRDS_B * v)
    # two interleaved Horner chains: half the waiting
    w = u * u
    even = multiply_add(w, 0.11706236339491206, 0.1538459496251843)
    odd = multiply_add(w, 0.11723178623876518, 0.1333480469384731)
    even = multiply_add(w, even, 0.22222222221655885)
    odd = multiply_add(w, odd, 0.18181818335392802)
    even = multiply_add(w, even, 0.4)
    odd = multiply_add(w, odd, 0.28571428571429364)
    rest = v * u * multiply_add(u, odd, even)
    total, lost = fast_two_sum(2.0 * s, t)
    return total, lost + (2.0 * s_lost + (t_lost + rest))


@register_jitable(**STRICT)
def log_in_two(x):
    """Return log x in two doubles, their sum off by 2^-65 of itself.

    The second is zero where the first is no finite number: of 0, infinity, NaN; NaN is
    the answer below 0, too.
    """
    tiny = x < SMALLEST_NORMAL
    normal = np.where(tiny, x * TWO_54, x)
    turns = exponent_of(normal)
    m = significand_of(normal, turns)
    k = (turns - WHOLE) - np.where(tiny, 54.0, 0.0)
    near, near_lost = _log_near_one(m)
    total, lost = fast_two_sum(k * LN2_A, near)
    log, log_lost = fast_two_sum(total, lost + multiply_add(k, LN2_B, near_lost))
    finite = (x > 0.0) & (x < np.inf)
    # of 0, infinity and NaN, and then below 0
    other = np.where(x == 0.0, -np.inf, np.where(x < 0.0, np.nan, x))
    return np.where(finite, log, other), np.where(finite, log_lost, 0.0)


@overload(np.log, jit_options=STRICT)
def log(x):
    """Return the natural logarithm; zeros, infinities, NaN and subnormal as NumPy."""
    if x is not vector:
        return None

    def implementation(x):
        first, second = log_in_two(x)
        return first + second

    return implementation
