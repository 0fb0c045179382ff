"""Branch-free powers of vectors, `x ** y` and `np.power`: at most 2 ulp."""

from __future__ import annotations

import operator

import numpy as np
from numba.core import types
from numba.extending import overload, register_jitable

from tolstat.lanes.binary import as_vector
from tolstat.lanes.elementary import multiply_add
from tolstat.lanes.exponential import exp_of_two
from tolstat.lanes.logarithm import log_in_two
from tolstat.lanes.vector import vector

STRICT = {"fastmath": False}


@register_jitable(**STRICT)
def _power(x, y):
    """Return e^(y log |x|), with the sign and the exceptions of x^y.

    A relative error of 2^-65 of the logarithm is an error of 2^-55 where y makes it
    745, the most that does not overflow: a quarter of an ulp of the result.
    """
    a = np.abs(x)
    log, log_lost = log_in_two(a)
    exponent = y * log
    lost = multiply_add(y, log, -exponent) + y * log_lost
    # infinities have no rounding error
    lost = np.where(np.isfinite(exponent), lost, 0.0)
    value = exp_of_two(exponent, lost)

    half = 0.5 * y
    whole = np.floor(y) == y  # an infinite y too, and it is even
    odd = whole & (np.floor(half) != half)
    value = np.where(odd, np.copysign(value, x), value)
    value = np.where((x < 0.0) & np.isfinite(x) & ~whole, np.nan, value)
    # also of NaN, and (-1)^inf
    one = (y == 0.0) | (x == 1.0) | ((x == -1.0) & (np.abs(y) == np.inf))
    return np.where(one, 1.0, value)


def _is_number(kind):
    return kind is vector or isinstance(kind, types.Float | types.Integer)


@overload(np.power)
@overload(operator.pow)
@overload(operator.ipow)
def power(x, y):
    """Return x^y, of vectors or of a vector and a plain number; exceptions as NumPy."""
    if vector in (x, y) and _is_number(x) and _is_number(y):
        return lambda x, y: _power(as_vector(x), as_vector(y))
    return None
