"""NumPy's elementary functions on vectors and masks: `np.sqrt`, `np.where`, ...

Importing this file registers them with Numba: equations in plain NumPy compile to
registers. Each is a few LLVM instructions.
"""

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types

from tolstat.lanes.vector import (
    DOUBLES,
    WIDTH,
    comparison,
    instructions,
    mask,
    teach,
    vector,
)


def call(builder, name, *values):
    """Write a call of one of LLVM's functions of vectors, or of a mask."""
    of_vector = values[0].type == DOUBLES
    result = DOUBLES if of_vector else ir.IntType(1)
    full_name = f"llvm.{name}.v{WIDTH}{'f64' if of_vector else 'i1'}"
    kind = ir.FunctionType(result, [value.type for value in values])
    function = cgutils.get_or_insert_function(builder.module, kind, full_name)
    return builder.call(function, values)


def of_llvm(name):
    """Return a function that writes a call of one of LLVM's functions."""
    return lambda builder, *values: call(builder, name, *values)


def _extremum(predicate):
    """Return a function that writes an extremum; NaN stays: failures are detected."""

    def write(builder, a, b):
        first = comparison(predicate)(builder, a, b)
        is_nan = comparison("!=")(builder, a, a)
        return builder.select(builder.or_(first, is_nan), a, b)

    return write


def _is_finite(builder, x):
    """Write which lanes hold a number, not infinity or NaN."""
    size = call(builder, "fabs", x)
    return comparison("<")(builder, size, ir.Constant(DOUBLES, [np.inf] * WIDTH))


teach(np.sqrt, of_llvm("sqrt"), vector, vector)
teach(np.abs, of_llvm("fabs"), vector, vector)
teach(np.floor, of_llvm("floor"), vector, vector)
teach(np.rint, of_llvm("rint"), vector, vector)
teach(np.any, of_llvm("vector.reduce.or"), types.boolean, mask)
teach(np.all, of_llvm("vector.reduce.and"), types.boolean, mask)
teach(np.where, ir.IRBuilder.select, vector, mask, vector, vector)
teach(np.copysign, of_llvm("copysign"), vector, vector, vector)
teach(np.maximum, _extremum(">="), vector, vector, vector)
teach(np.minimum, _extremum("<="), vector, vector, vector)
teach(np.isfinite, _is_finite, mask, vector)


@instructions(vector, vector, vector, vector)
def multiply_add(builder, a, b, c):
    """Write a b + c, rounded once."""
    return call(builder, "fma", a, b, c)
