"""Branch-free sin, cos and arctan of vectors.

sin and cos err by at most 2 ulp up to |x| = 1e6, beyond which they are NaN; arctan by
1.1e-13 of itself, with one division.
"""

from __future__ import annotations

import numpy as np
from numba.extending import intrinsic, overload, register_jitable

from tolstat.lanes.binary import INTEGERS, WHOLE, each
from tolstat.lanes.elementary import multiply_add
from tolstat.lanes.vector import DOUBLES, mask, vector

FARTHEST = 1e6
TWO_OVER_PI = 0.6366197723675814
# pi/2 in three parts of 53 bits, none below zero: they keep the sign of a zero
PI_2_A = 1.5707963267948966
PI_2_B = 6.123233995736765e-17
PI_2_C = 1.082856673921914e-32

STRICT = {"fastmath": False}


@intrinsic
def _is_odd(typingctx, turns):
    """Tell where the whole number in the last bits is odd."""

    def codegen(context, builder, sig, args):
        last = builder.and_(builder.bitcast(args[0], INTEGERS), each(1))
        return builder.icmp_unsigned("!=", last, each(0))

    return mask(vector), codegen


@intrinsic
def _signed_by(typingctx, x, turns):
    """Change the sign of x where the second last bit of the turns is set."""

    def codegen(context, builder, sig, args):
        value, turns = (builder.bitcast(arg, INTEGERS) for arg in args)
        sign = builder.and_(builder.shl(turns, each(62)), each(-(2**63)))
        return builder.bitcast(builder.xor(value, sign), DOUBLES)

    return vector(vector, vector), codegen


@register_jitable(**STRICT)
def _reduce(x):
    """Write x = n pi/2 + r with |r| <= pi/4; return r, and n in the last bits.

    x - n A is exact: a multiple of 2^-53 below 1. With n B it is rounded once, so that
    no digit is lost near a multiple of pi/2; n C is below that rounding error.

    References
    ----------
    S. Boldo, M. Daumas, R.-C. Li, Formally verified argument reduction with a fused
    multiply-add, IEEE Trans. Comput. 58 (2009) 1139-1145.
    """
    near = np.where(np.abs(x) <= FARTHEST, x, np.nan)
    turns = multiply_add(near, TWO_OVER_PI, WHOLE)
    n = turns - WHOLE
    r = multiply_add(-n, PI_2_B, multiply_add(-n, PI_2_A, x))
    return multiply_add(-n, PI_2_C, r), turns


@register_jitable(**STRICT)
def _sin_near_zero(r):
    """Return sin r for |r| <= pi/4; Chebyshev fit of 6 terms, error 2e-17."""
    u = r * r
    p = multiply_add(u, 1.5918115263265747e-10, -2.5051131650235178e-08)
    p = multiply_add(u, p, 2.7557316101617874e-06)
    p = multiply_add(u, p, -0.00019841269836756774)
    p = multiply_add(u, p, 0.008333333333330948)
    p = multiply_add(u, p, -0.16666666666666666)
    return r * multiply_add(u, p, 1.0)


@register_jitable(**STRICT)
def _cos_near_zero(r):
    """Return cos r for |r| <= pi/4; Chebyshev fit of 6 terms, error 2e-18."""
    u = r * r
    p = multiply_add(u, -1.1382623647474462e-11, 2.087614614655861e-09)
    p = multiply_add(u, p, -2.7557317271145144e-07)
    p = multiply_add(u, p, 2.480158729876456e-05)
    p = multiply_add(u, p, -0.0013888888888887398)
    p = multiply_add(u, p, 0.041666666666666664)
    return multiply_add(u * u, p, multiply_add(u, -0.5, 1.0))


@overload(np.sin, jit_options=STRICT)
def sin(x):
    """Return the sine; zeros keep their sign, above 1e6 it is NaN."""
    if x is not vector:
        return None

    def implementation(x):
        r, turns = _reduce(x)
        value = np.where(_is_odd(turns), _cos_near_zero(r), _sin_near_zero(r))
        return _signed_by(value, turns)

    return implementation


@overload(np.cos, jit_options=STRICT)
def cos(x):
    """Return the cosine; above 1e6 it is NaN."""
    if x is not vector:
        return None

    def implementation(x):
        r, turns = _reduce(x)
        value = np.where(_is_odd(turns), _sin_near_zero(r), _cos_near_zero(r))
        return _signed_by(value, turns + 1.0)

    return implementation


TAN_PI_8 = 0.41421356237309503
TAN_3PI_8 = 2.414213562373095
PI_4 = 0.7853981633974483
PI_2 = 1.5707963267948966


@overload(np.arctan, jit_options={"fastmath": False})
def arctan(x):
    """Return the angle whose tangent is x; zeros, infinities and NaN as NumPy.

    |x| is reduced to |t| <= tan(pi/8) by atan(x) = pi/4 + atan((x - 1)/(x + 1)) or
    pi/2 - atan(1/x). There atan(t) = t + t^3 A(t^2), A the Chebyshev fit of 8 terms
    computed with 200 bits, whose error dominates. Three more terms would cost time, and
    no error control of a smooth friction or contact law would see them.
    """
    if x is not vector:
        return None

    def implementation(x):
        a = np.abs(x)
        middle = a > TAN_PI_8
        far = a > TAN_3PI_8
        numerator = np.where(far, -1.0, np.where(middle, a - 1.0, a))
        denominator = np.where(far, a, np.where(middle, a + 1.0, 1.0))
        t = numerator / denominator
        base = np.where(far, PI_2, np.where(middle, PI_4, 0.0))
        u = t * t
        # two interleaved Horner chains: half the waiting
        v = u * u
        even = multiply_add(v, -0.06027307460946675, -0.09084101895346429)
        odd = multiply_add(v, 0.03295679541870136, 0.07604800046078292)
        even = multiply_add(v, even, -0.142857081103604)
        odd = multiply_add(v, odd, 0.11110819716745676)
        even = multiply_add(v, even, -0.33333333333266196)
        odd = multiply_add(v, odd, 0.19999999949854794)
        angle = base + multiply_add(t * u, multiply_add(u, odd, even), t)
        return np.copysign(angle, x)

    return implementation
