"""NumPy's elementary functions on vectors and masks: `np.sqrt`, `np.where`, ...

Importing this file registers them with Numba: equations in plain NumPy compile to
registers. Each is a few LLVM instructions.
"""

from __future__ import annotations

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import overload

from tolstat.lanes.vector import DOUBLES, WIDTH, instructions, mask, vector


def call(builder, name, *values):
    """Return a call of one of LLVM's functions of vectors, or of a mask."""
    of_vector = values[0].type == DOUBLES
    result = DOUBLES if of_vector else ir.IntType(1)
    full_name = f"llvm.{name}.v{WIDTH}{'f64' if of_vector else 'i1'}"
    kind = ir.FunctionType(result, [value.type for value in values])
    function = cgutils.get_or_insert_function(builder.module, kind, full_name)
    return builder.call(function, values)


def _teach(function, name, result=vector, argument=vector):
    """Teach Numba a NumPy function of one vector or mask."""

    @instructions(result, argument)
    def of_lanes(builder, x):
        return call(builder, name, x)

    @overload(function)
    def implement(x):
        return (lambda x: of_lanes(x)) if x is argument else None


_teach(np.sqrt, "sqrt")
_teach(np.abs, "fabs")
_teach(np.floor, "floor")
_teach(np.rint, "rint")
_teach(np.any, "vector.reduce.or", types.boolean, mask)
_teach(np.all, "vector.reduce.and", types.boolean, mask)


@instructions(vector, mask, vector, vector)
def _select(builder, condition, a, b):
    return builder.select(condition, a, b)


@instructions(vector, vector, vector)
def _copysign(builder, x, sign):
    return call(builder, "copysign", x, sign)


@instructions(vector, vector, vector, vector)
def multiply_add(builder, a, b, c):
    """Return a b + c, rounded once."""
    return call(builder, "fma", a, b, c)


@overload(np.where)
def where(condition, a, b):
    """Return a if the condition holds, otherwise b; both are computed."""
    if condition is mask:
        return lambda condition, a, b: _select(condition, a, b)
    return None


@overload(np.copysign)
def copysign(x, sign):
    """Return x with the sign of another number, signed zeros and NaN included."""
    if vector in (x, sign):
        return lambda x, sign: _copysign(x, sign)
    return None


@overload(np.maximum, jit_options={"fastmath": False})
def maximum(a, b):
    """Return the greater; NaN on either side stays, so diverged trials are detected."""
    if vector in (a, b):
        return lambda a, b: _select((a >= b) | (a != a), a, b)
    return None


@overload(np.minimum, jit_options={"fastmath": False})
def minimum(a, b):
    """Return the lesser; NaN on either side stays."""
    if vector in (a, b):
        return lambda a, b: _select((a <= b) | (a != a), a, b)
    return None


@overload(np.isfinite, jit_options={"fastmath": False})
def isfinite(x):
    """Return which lanes hold a number, not infinity or NaN."""
    if x is vector:
        return lambda x: np.abs(x) < np.inf
    return None
