"""Branch-free sin and cos of a vector: at most 2 ulp up to |x| = 1e6, then NaN."""

from __future__ import annotations

import numpy as np
from numba.extending import overload, register_jitable

from tolstat.lanes.elementary import multiply_add
from tolstat.lanes.vector import vector

FARTHEST = 1e6
TWO_OVER_PI = 0.6366197723675814
# pi/2 in three parts of 53 bits
PI_2_A = 1.5707963267948966
PI_2_B = 6.123233995736766e-17
PI_2_C = -1.4973849048591698e-33

STRICT = {"fastmath": False}


@register_jitable(**STRICT)
def _reduce(x):
    """Write x = n pi/2 + r + rest with |r| <= pi/4; return r, rest, n mod 4.

    x - n A is exact: it is a multiple of 2^-53 below 1. What n B adds is carried
    along with its rounding errors, so nothing is lost near a multiple of pi/2.

    References
    ----------
    S. Boldo, M. Daumas, R.-C. Li, Formally verified argument reduction with a fused
    multiply-add, IEEE Trans. Comput. 58 (2009) 1139-1145.
    """
    n = np.where(np.abs(x) <= FARTHEST, np.rint(x * TWO_OVER_PI), np.nan)
    a = multiply_add(-n, PI_2_A, x)
    b = n * PI_2_B
    b_error = multiply_add(n, PI_2_B, -b)
    r = a - b
    rest = ((a - r) - b) - multiply_add(n, PI_2_C, b_error)
    return r, rest, n - 4.0 * np.floor(0.25 * n)


@register_jitable(**STRICT)
def _sin_near_zero(r, rest):
    """Return sin(r + rest) for |r| <= pi/4; Chebyshev fit of 6 terms, error 2e-17."""
    u = r * r
    p = multiply_add(u, 1.5918115263265747e-10, -2.5051131650235178e-08)
    p = multiply_add(u, p, 2.7557316101617874e-06)
    p = multiply_add(u, p, -0.00019841269836756774)
    p = multiply_add(u, p, 0.008333333333330948)
    p = multiply_add(u, p, -0.16666666666666666)
    return r + multiply_add(r * u, p, rest * (1.0 - 0.5 * u))


@register_jitable(**STRICT)
def _cos_near_zero(r, rest):
    """Return cos(r + rest) for |r| <= pi/4; Chebyshev fit of 6 terms, error 2e-18."""
    u = r * r
    p = multiply_add(u, -1.1382623647474462e-11, 2.087614614655861e-09)
    p = multiply_add(u, p, -2.7557317271145144e-07)
    p = multiply_add(u, p, 2.480158729876456e-05)
    p = multiply_add(u, p, -0.0013888888888887398)
    p = multiply_add(u, p, 0.041666666666666664)
    half = 0.5 * u
    leading = 1.0 - half
    lost = (1.0 - leading) - half
    return leading + multiply_add(u * u, p, lost - r * rest)


@overload(np.sin, jit_options=STRICT)
def sin(x):
    """Return the sine; zeros keep their sign, beyond 1e6 the answer is NaN."""
    if x is not vector:
        return None

    def implementation(x):
        r, rest, quadrant = _reduce(x)
        odd = np.abs(quadrant - 2.0) == 1.0
        value = np.where(odd, _cos_near_zero(r, rest), _sin_near_zero(r, rest))
        value = np.where(quadrant >= 2.0, -value, value)
        return np.where(x == 0.0, x, value)

    return implementation


@overload(np.cos, jit_options=STRICT)
def cos(x):
    """Return the cosine; beyond 1e6 the answer is NaN."""
    if x is not vector:
        return None

    def implementation(x):
        r, rest, quadrant = _reduce(x)
        odd = np.abs(quadrant - 2.0) == 1.0
        value = np.where(odd, _sin_near_zero(r, rest), _cos_near_zero(r, rest))
        return np.where(np.abs(quadrant - 1.5) < 1.0, -value, value)

    return implementation
