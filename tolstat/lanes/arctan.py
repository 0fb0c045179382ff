"""Branch-free arctan of a vector: right to 1.1e-13 of itself, one division."""

from __future__ import annotations

import numpy as np
from numba.extending import overload

from tolstat.lanes.elementary import multiply_add
from tolstat.lanes.vector import vector

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
