"""Branch-free arctan of a vector: at most 2 ulp, one division."""

from __future__ import annotations

import numpy as np
from numba.extending import overload

from tolstat.lanes.elementary import multiply_add
from tolstat.lanes.vector import vector

TAN_PI_8 = 0.41421356237309503
TAN_3PI_8 = 2.414213562373095
PI_4 = 0.7853981633974483
PI_4_REST = 3.061616997868383e-17
PI_2 = 1.5707963267948966
PI_2_REST = 6.123233995736766e-17


@overload(np.arctan, jit_options={"fastmath": False})
def arctan(x):
    """Return the angle whose tangent is x; zeros, infinities and NaN as NumPy.

    |x| is reduced to |t| <= tan(pi/8) by atan(x) = pi/4 + atan((x - 1)/(x + 1)) or
    pi/2 - atan(1/x). There atan(t) = t + t^3 A(t^2), A the Chebyshev fit of 11 terms
    computed with 200 bits (error 3e-17).
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
        rest = np.where(far, PI_2_REST, np.where(middle, PI_4_REST, 0.0))
        u = t * t
        # two interleaved Horner chains: half the waiting
        v = u * u
        even = multiply_add(v, -0.01917540471101196, -0.050854078345862384)
        odd = multiply_add(v, 0.039230447784709195, 0.058581409048656254)
        even = multiply_add(v, even, -0.06664510525508843)
        odd = multiply_add(v, odd, 0.07692183125376885)
        even = multiply_add(v, even, -0.09090904575306488)
        odd = multiply_add(v, odd, 0.11111111015187018)
        even = multiply_add(v, even, -0.14285714284665682)
        odd = multiply_add(v, odd, 0.19999999999995516)
        even = multiply_add(v, even, -0.3333333333333333)
        series = multiply_add(u, odd, even)
        angle = base + (t + multiply_add(t * u, series, rest))
        return np.copysign(angle, x)

    return implementation
