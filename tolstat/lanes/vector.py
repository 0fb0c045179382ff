"""The vector of lanes: a Numba type holding one float64 of each of WIDTH trials.

LLVM splits it on processors with narrower registers: the width is a constant of the
package, not of the processor. Operators of vectors and masks work lane by lane, and so
do NumPy's elementary functions that are registered here: `np.sqrt`, `np.where`, ...
Each is a few LLVM instructions.
"""

import operator

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.core.typeconv import Conversion
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin, lower_cast, models, register_model

WIDTH = 8

DOUBLES = ir.VectorType(ir.DoubleType(), WIDTH)
BITS = ir.VectorType(ir.IntType(1), WIDTH)


class Taught(types.Type):
    """A type that only functions given to `teach` take, and none of Numba's own."""


class VectorType(Taught):
    """A float64 in every lane."""

    value = DOUBLES

    def __init__(self) -> None:
        super().__init__(name=f"lanes({WIDTH})")

    def can_convert_from(self, typingctx, other):
        """Return the conversion of a plain number, to the same number in every lane."""
        if isinstance(other, types.Float | types.Integer):
            return Conversion.unsafe
        return None


class MaskType(Taught):
    """A truth value in every lane."""

    value = BITS

    def __init__(self) -> None:
        super().__init__(name=f"mask({WIDTH})")


vector = VectorType()
mask = MaskType()


@register_model(VectorType)
@register_model(MaskType)
class LanesModel(models.PrimitiveModel):
    """A vector or a mask is one LLVM value."""

    def __init__(self, dmm, fe_type):
        super().__init__(dmm, fe_type, fe_type.value)


def broadcast(builder, scalar):
    """Return a vector with an LLVM double in every lane."""
    first = builder.insert_element(
        ir.Constant(DOUBLES, ir.Undefined), scalar, ir.Constant(ir.IntType(32), 0)
    )
    zeros = ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), [0] * WIDTH)
    return builder.shuffle_vector(first, ir.Constant(DOUBLES, ir.Undefined), zeros)


@lower_cast(types.Float, VectorType)
@lower_cast(types.Integer, VectorType)
def cast_number(context, builder, fromty, toty, val):
    """Return a plain number in every lane."""
    return broadcast(builder, context.cast(builder, val, fromty, types.float64))


def instructions(result, *arguments):
    """Return a decorator: compiled code can call a function of builder and LLVM values.

    Parameters
    ----------
    result : types.Type
        Type of the result.
    *arguments : types.Type
        Types of the arguments, up to three.
    """

    def decorate(write):
        def codegen(context, builder, sig, args):
            return write(builder, *args)

        typed = result(*arguments), codegen
        of_one, of_two, of_three = (
            lambda typingctx, a: typed,
            lambda typingctx, a, b: typed,
            lambda typingctx, a, b, c: typed,
        )
        return intrinsic((of_one, of_two, of_three)[len(arguments) - 1])

    return decorate


def teach(function, write, result, *arguments):
    """Teach Numba a function of vectors, masks or rows, and of plain numbers.

    The instructions stand in the caller: a function of its own, as an `overload`, would
    be compiled for each type of its arguments.

    Parameters
    ----------
    function : callable
        An operator, or a function of NumPy or Python.
    write : callable
        Writes the instructions: of the builder and LLVM values.
    result : types.Type
        Type of the result.
    *arguments : types.Type
        Types of the arguments. A call without any vector, mask or rows stays Numba's.
    """
    typed = signature(result, *arguments)

    @infer_global(function)
    class Template(AbstractTemplate):
        metadata = {"target": "cpu"}  # noqa: RUF012  tried before Numba's own

        def generic(self, args, kws):
            taught = any(isinstance(arg, Taught) for arg in args)
            if kws or not taught or len(args) != len(arguments):
                return None
            pairs = zip(args, arguments, strict=True)
            fits = all(self.context.can_convert(*pair) is not None for pair in pairs)
            return typed if fits else None

    @lower_builtin(function, *arguments)
    def lower(context, builder, sig, args):
        return write(builder, *args)


for op, inplace, instruction in (
    (operator.add, operator.iadd, ir.IRBuilder.fadd),
    (operator.sub, operator.isub, ir.IRBuilder.fsub),
    (operator.mul, operator.imul, ir.IRBuilder.fmul),
    (operator.truediv, operator.itruediv, ir.IRBuilder.fdiv),
):
    teach(op, instruction, vector, vector, vector)
    teach(inplace, instruction, vector, vector, vector)


def comparison(predicate):
    """Return a function that compares as NumPy: with NaN, only "not equal" is true."""
    ordered, unordered = ir.IRBuilder.fcmp_ordered, ir.IRBuilder.fcmp_unordered
    compare = unordered if predicate == "!=" else ordered
    return lambda builder, a, b: compare(builder, predicate, a, b)


teach(operator.lt, comparison("<"), mask, vector, vector)
teach(operator.le, comparison("<="), mask, vector, vector)
teach(operator.gt, comparison(">"), mask, vector, vector)
teach(operator.ge, comparison(">="), mask, vector, vector)
teach(operator.eq, comparison("=="), mask, vector, vector)
teach(operator.ne, comparison("!="), mask, vector, vector)
teach(operator.and_, ir.IRBuilder.and_, mask, mask, mask)
teach(operator.or_, ir.IRBuilder.or_, mask, mask, mask)
teach(operator.xor, ir.IRBuilder.xor, mask, mask, mask)
teach(operator.invert, ir.IRBuilder.not_, mask, mask)
teach(operator.neg, ir.IRBuilder.fneg, vector, vector)
teach(operator.pos, lambda builder, x: x, vector, vector)


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
