"""Branch-free sin, cos and arctan of vectors.

sin and cos err by at most 2 ulp up to |x| = 1e6, and are NaN above. arctan has a
relative error of at most 1.1e-13, with one division.
"""

import numpy as np
from numba.extending import register_jitable

from tolstat.lanes.binary import (
    INTEGERS,
    STRICT,
    WHOLE,
    horner,
    in_all_lanes,
    on_vectors,
    two_chains,
)
from tolstat.lanes.vector import DOUBLES, instructions, mask, multiply_add, vector

FARTHEST = 1e6
TWO_OVER_PI = 0.6366197723675814
# pi/2 in three parts of 53 bits, none below zero: they keep the sign of a zero
PI_2_A = 1.5707963267948966
PI_2_B = 6.123233995736765e-17
PI_2_C = 1.082856673921914e-32

# Chebyshev fits for |r| <= pi/4, errors 2e-17 and 2e-18, in r^2: of (sin r)/r and of
# (cos r - 1 + r^2/2)/r^4
SIN_SERIES = horner(
    1.0, -0.16666666666666666, 0.008333333333330948, -0.00019841269836756774,
    2.7557316101617874e-06, -2.5051131650235178e-08, 1.5918115263265747e-10,
)  # fmt: skip
COS_SERIES = horner(
    0.041666666666666664, -0.0013888888888887398, 2.480158729876456e-05,
    -2.7557317271145144e-07, 2.087614614655861e-09, -1.1382623647474462e-11,
)  # fmt: skip


@instructions(mask, vector)
def _is_odd(builder, turns):
    """Return whether the whole number in the last bits is odd."""
    last = builder.and_(builder.bitcast(turns, INTEGERS), in_all_lanes(1))
    return builder.icmp_unsigned("!=", last, in_all_lanes(0))


@instructions(vector, vector, vector)
def _signed_by(builder, x, turns):
    """Return x with its sign changed where the second last bit of `turns` is set."""
    value, turns = (builder.bitcast(arg, INTEGERS) for arg in (x, turns))
    sign = builder.and_(builder.shl(turns, in_all_lanes(62)), in_all_lanes(-(2**63)))
    return builder.bitcast(builder.xor(value, sign), DOUBLES)


@register_jitable(**STRICT)
def _reduce(x):
    """Return r, and n in the last bits, of x = n pi/2 + r with |r| <= pi/4.

    x - n A is exact: a multiple of 2^-53 below 1. With n B it is rounded once, so that
    no digit is lost near a multiple of pi/2; n C is below that rounding error.

    References
    ----------
    S. Boldo, M. Daumas, R.-C. Li, Formally verified argument reduction with a fused
    multiply-add, IEEE Trans. Comput. 58 (2009) 1139-1145.
    """
    in_range = np.where(np.abs(x) <= FARTHEST, x, np.nan)
    turns = multiply_add(in_range, TWO_OVER_PI, WHOLE)
    n = turns - WHOLE
    r = multiply_add(-n, PI_2_B, multiply_add(-n, PI_2_A, x))
    return multiply_add(-n, PI_2_C, r), turns


@register_jitable(**STRICT)
def _sin_near_zero(r):
    """Return sin r for |r| <= pi/4."""
    return r * SIN_SERIES(r * r)


@register_jitable(**STRICT)
def _cos_near_zero(r):
    """Return cos r for |r| <= pi/4."""
    u = r * r
    return multiply_add(u * u, COS_SERIES(u), multiply_add(u, -0.5, 1.0))


@on_vectors(np.sin)
def sin(x):
    """Return the sine; zeros keep their sign, above 1e6 it is NaN."""
    r, turns = _reduce(x)
    value = np.where(_is_odd(turns), _cos_near_zero(r), _sin_near_zero(r))
    return _signed_by(value, turns)


@on_vectors(np.cos)
def cos(x):
    """Return the cosine; above 1e6 it is NaN."""
    r, turns = _reduce(x)
    value = np.where(_is_odd(turns), _sin_near_zero(r), _cos_near_zero(r))
    return _signed_by(value, turns + 1.0)


TAN_PI_8 = 0.41421356237309503
TAN_3PI_8 = 2.414213562373095
PI_4 = 0.7853981633974483
ARCTAN_SERIES = two_chains(
    -0.33333333333266196, 0.19999999949854794, -0.142857081103604, 0.11110819716745676,
    -0.09084101895346429, 0.07604800046078292, -0.06027307460946675,
    0.03295679541870136,
)  # fmt: skip


@on_vectors(np.arctan)
def arctan(x):
    """Return the angle whose tangent is x; zeros, infinities and NaN as NumPy.

    |x| is reduced to |t| <= tan(pi/8) by atan(x) = pi/4 + atan((x - 1)/(x + 1)) or
    pi/2 - atan(1/x). There atan(t) = t + t^3 A(t^2), A the Chebyshev fit of 8 terms
    computed with 200 bits, whose error dominates. Three more terms would cost time
    without any effect on the error control of a smooth friction or contact law.
    """
    a = np.abs(x)
    middle = a > TAN_PI_8
    large = a > TAN_3PI_8
    numerator = np.where(large, -1.0, np.where(middle, a - 1.0, a))
    denominator = np.where(large, a, np.where(middle, a + 1.0, 1.0))
    t = numerator / denominator
    base = np.where(large, PI_2_A, np.where(middle, PI_4, 0.0))
    u = t * t
    angle = base + multiply_add(t * u, ARCTAN_SERIES(u), t)
    return np.copysign(angle, x)
