"""NumPy's elementary functions on vectors and masks: `np.sqrt`, `np.where`, ...

Importing this file registers them with Numba, so that equations in plain NumPy compile
to registers. Each is a few LLVM instructions.
"""

from __future__ import annotations

import numpy as np
from llvmlite import ir
from numba.core import types
from numba.extending import intrinsic, overload

from tolstat.lanes.vector import DOUBLES, WIDTH, mask, vector

_PER_LANE = f"v{WIDTH}f64"


def _call(builder, name, result, values):
    """Call one of LLVM's vector functions, declared by its full name."""
    function = builder.module.globals.get(name)
    if function is None:
        fnty = ir.FunctionType(result, [value.type for value in values])
        function = ir.Function(builder.module, fnty, name)
    return builder.call(function, values)


def _teach(function, name):
    """Teach Numba a NumPy function of one vector."""

    @intrinsic
    def call(typingctx, x):
        def codegen(context, builder, sig, args):
            return _call(builder, f"llvm.{name}.{_PER_LANE}", DOUBLES, args)

        return vector(vector), codegen

    @overload(function)
    def implement(x):
        return (lambda x: call(x)) if x is vector else None


def _teach_reduction(function, name):
    """Teach Numba a function from a mask to one truth value."""

    @intrinsic
    def call(typingctx, m):
        def codegen(context, builder, sig, args):
            full_name = f"llvm.vector.reduce.{name}.v{WIDTH}i1"
            return _call(builder, full_name, ir.IntType(1), args)

        return types.boolean(mask), codegen

    @overload(function)
    def implement(m):
        return (lambda m: call(m)) if m is mask else None


_teach(np.sqrt, "sqrt")
_teach(np.abs, "fabs")
_teach(np.floor, "floor")
_teach(np.rint, "rint")
_teach_reduction(np.any, "or")
_teach_reduction(np.all, "and")


@intrinsic
def _select(typingctx, condition, a, b):
    def codegen(context, builder, sig, args):
        return builder.select(*args)

    return vector(mask, vector, vector), codegen


@intrinsic
def _copysign(typingctx, x, sign):
    def codegen(context, builder, sig, args):
        return _call(builder, f"llvm.copysign.{_PER_LANE}", DOUBLES, args)

    return vector(vector, vector), codegen


@intrinsic
def multiply_add(typingctx, a, b, c):
    """Return a b + c, rounded once."""

    def codegen(context, builder, sig, args):
        return _call(builder, f"llvm.fma.{_PER_LANE}", DOUBLES, args)

    return vector(vector, vector, vector), codegen


@overload(np.where)
def where(condition, a, b):
    """Take a where the condition holds, else b; both are computed."""
    if condition is mask:
        return lambda condition, a, b: _select(condition, a, b)
    return None


@overload(np.copysign)
def copysign(x, sign):
    """Give x the sign of another number, signed zeros and NaN included."""
    if vector in (x, sign):
        return lambda x, sign: _copysign(x, sign)
    return None


@overload(np.maximum, jit_options={"fastmath": False})
def maximum(a, b):
    """Take the greater; a NaN on either side stays, so diverged trials are seen."""
    if vector in (a, b):
        return lambda a, b: _select((a >= b) | (a != a), a, b)
    return None


@overload(np.minimum, jit_options={"fastmath": False})
def minimum(a, b):
    """Take the lesser; a NaN on either side stays."""
    if vector in (a, b):
        return lambda a, b: _select((a <= b) | (a != a), a, b)
    return None


@overload(np.isfinite, jit_options={"fastmath": False})
def isfinite(x):
    """Tell which lanes hold a number, not an infinity or NaN."""
    if x is vector:
        return lambda x: np.abs(x) < np.inf
    return None
