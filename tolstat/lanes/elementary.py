"""Branch-free elementary functions of vectors.

sin and cos err by at most 2 ulp up to |x| = 1e6, and are NaN above. arctan has a
relative error of at most 1.1e-13, with one division. log, exp and powers err by at most
2 ulp; log and exp also have forms in two doubles. log1p, expm1 and tanh keep the digits
of small numbers: they err by at most 4 ulp.
"""

import operator

import numpy as np
from numba.extending import overload, register_jitable

from tolstat.lanes import binary
from tolstat.lanes.binary import (
    INTEGERS,
    STRICT,
    WHOLE,
    fast_two_sum,
    horner,
    in_all_lanes,
    on_vectors,
    two_chains,
    two_product,
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


SMALLEST_NORMAL = 2.2250738585072014e-308
TWO_54 = 18014398509481984.0
# ln 2 in two parts; the first has 42 bits, so that k of them are exact
LN2_A = 0.6931471805598903
LN2_B = 5.497923018708371e-14
# 2/3 in two parts
TWO_THIRDS_A = 0.6666666666666666
TWO_THIRDS_B = 3.700743415417188e-17
# Chebyshev fit of 8 terms, error 2e-18
LOG_SERIES = binary.two_chains(
    0.4, 0.28571428571429364, 0.22222222221655885, 0.18181818335392802,
    0.1538459496251843, 0.1333480469384731, 0.11706236339491206, 0.11723178623876518,
)  # fmt: skip


@register_jitable(**STRICT)
def _log_near_one(m):
    """Return log m in two doubles, m from sqrt(1/2) to sqrt(2); off by 2^-66 of itself.

    log m = 2 atanh s = 2 s + 2/3 s^3 + s^5 A(s^2), s = (m - 1)/(m + 1): the first two
    terms in two doubles, A the series.
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
    rest = v * u * LOG_SERIES(u)
    total, lost = fast_two_sum(2.0 * s, t)
    return total, lost + (2.0 * s_lost + (t_lost + rest))


@register_jitable(**STRICT)
def log_in_two(x):
    """Return log x in two doubles, their sum off by 2^-65 of itself.

    The second is zero if the first is not finite: for x of 0, infinity or NaN. Below 0
    the first is NaN.
    """
    tiny = x < SMALLEST_NORMAL
    normal = np.where(tiny, x * TWO_54, x)
    turns = binary.exponent_of(normal)
    m = binary.significand_of(normal, turns)
    k = (turns - WHOLE) - np.where(tiny, 54.0, 0.0)
    log_m, log_m_lost = _log_near_one(m)
    total, lost = fast_two_sum(k * LN2_A, log_m)
    log, log_lost = fast_two_sum(total, lost + multiply_add(k, LN2_B, log_m_lost))
    finite = (x > 0.0) & (x < np.inf)
    # for 0, infinity and NaN, and for x below 0
    other = np.where(x == 0.0, -np.inf, np.where(x < 0.0, np.nan, x))
    return np.where(finite, log, other), np.where(finite, log_lost, 0.0)


@on_vectors(np.log)
def log(x):
    """Return the natural logarithm; zeros, infinities, NaN and subnormal as NumPy."""
    first, second = log_in_two(x)
    return first + second


PER_LN2 = 1.4426950408889634
# outside, the result is 0 or infinite
LOWEST, HIGHEST = -750.0, 715.0
# Chebyshev fit of 10 terms, error 1e-17 of e^r
EXP_SERIES = binary.two_chains(
    0.5, 0.16666666666666669, 0.04166666666662413, 0.008333333333330062,
    0.0013888888917213717, 0.00019841269863053618, 2.4801521295954376e-05,
    2.7557268459997064e-06, 2.7620088445409746e-07, 2.510038549551032e-08,
)  # fmt: skip


@register_jitable(**STRICT)
def _reduced(x, x_lost):
    """Return r, e^r - 1 - r, and n in the last bits, x + x_lost = n ln 2 + r.

    |r| <= ln 2/2; e^r = 1 + r + r^2 Q(r), Q the series.
    """
    clipped = np.minimum(np.maximum(x, LOWEST), HIGHEST)
    turns = multiply_add(clipped, PER_LN2, WHOLE)
    n = turns - WHOLE
    # n LN2_A is exact, and so is the difference
    a = multiply_add(-n, LN2_A, clipped)
    b = multiply_add(-n, LN2_B, np.where(clipped == x, x_lost, 0.0))
    r = a + b
    # with the rounding error of r
    return r, multiply_add(r * r, EXP_SERIES(r), b - (r - a)), turns


@register_jitable(**STRICT)
def exp_of_two(x, x_lost):
    """Return e^(x + x_lost); x_lost is a correction below the precision of x."""
    r, rest, turns = _reduced(x, x_lost)
    return binary.times_power(1.0 + (r + rest), turns)


@on_vectors(np.exp)
def exp(x):
    """Return e^x; infinities, NaN and subnormal results as NumPy."""
    return exp_of_two(x, 0.0)


@on_vectors(np.expm1)
def expm1(x):
    """Return e^x - 1; infinities and NaN as NumPy."""
    r, rest, turns = _reduced(x, 0.0)
    power = binary.times_power(1.0 + (r + rest), turns)
    return np.where(turns == WHOLE, r + rest, power - 1.0)


@on_vectors(np.tanh)
def tanh(x):
    """Return the hyperbolic tangent, of e^(-2 |x|) - 1."""
    less = np.expm1(-2.0 * np.abs(x))
    return np.copysign(less / (less + 2.0), x)


@on_vectors(np.log1p)
def log1p(x):
    """Return log(1 + x); infinities and NaN as NumPy.

    The logarithm of the rounded sum, less what was rounded.
    """
    total = 1.0 + x
    rounded = ((total - 1.0) - x) / total
    return np.log(total) - np.where(np.isfinite(rounded), rounded, 0.0)


@register_jitable(**STRICT)
def _power(x, y):
    """Return e^(y log |x|), with the sign and the exceptions of x^y.

    A relative error of 2^-65 of the logarithm is an error of 2^-55 at y log |x| = 745,
    the most that does not overflow: a quarter of an ulp of the result.
    """
    a = np.abs(x)
    log, log_lost = log_in_two(a)
    exponent = y * log
    lost = multiply_add(y, log, -exponent) + y * log_lost
    # infinities have no rounding error
    lost = np.where(np.isfinite(exponent), lost, 0.0)
    value = exp_of_two(exponent, lost)

    half = 0.5 * y
    is_integer = np.floor(y) == y  # an infinite y too, and it is even
    odd = is_integer & (np.floor(half) != half)
    value = np.where(odd, np.copysign(value, x), value)
    value = np.where((x < 0.0) & np.isfinite(x) & ~is_integer, np.nan, value)
    # also of NaN, and (-1)^inf
    is_one = (y == 0.0) | (x == 1.0) | ((x == -1.0) & (np.abs(y) == np.inf))
    return np.where(is_one, 1.0, value)


@overload(np.power)
@overload(operator.pow)
@overload(operator.ipow)
def power(x, y):
    """Return x^y, of vectors or of a vector and a plain number; exceptions as NumPy."""
    if vector in (x, y):
        return lambda x, y: _power(binary.as_vector(x), binary.as_vector(y))
    return None
