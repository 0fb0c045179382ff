"""The vector of lanes: a Numba type holding one float64 of each of WIDTH trials.

LLVM splits it on processors with narrower registers: the width is a constant of the
package, not of the processor. Operators of vectors and masks work lane by lane.
"""

from __future__ import annotations

import operator

from llvmlite import ir
from numba.core import types
from numba.core.typeconv import Conversion
from numba.core.typing.templates import ConcreteTemplate, infer_global, signature
from numba.extending import (
    intrinsic,
    lower_builtin,
    lower_cast,
    models,
    overload,
    register_model,
)

WIDTH = 8

DOUBLES = ir.VectorType(ir.DoubleType(), WIDTH)
BITS = ir.VectorType(ir.IntType(1), WIDTH)


class VectorType(types.Type):
    """A float64 in every lane."""

    held = DOUBLES

    def __init__(self) -> None:
        super().__init__(name=f"lanes({WIDTH})")

    def can_convert_from(self, typingctx, other):
        """Return the conversion of a plain number, to the same number in every lane."""
        if isinstance(other, types.Float | types.Integer):
            return Conversion.unsafe  # worst rank: plain arithmetic stays plain
        return None


class MaskType(types.Type):
    """A truth value in every lane."""

    held = BITS

    def __init__(self) -> None:
        super().__init__(name=f"mask({WIDTH})")


vector = VectorType()
mask = MaskType()


@register_model(VectorType)
@register_model(MaskType)
class LanesModel(models.PrimitiveModel):
    """A vector or a mask is one LLVM value."""

    def __init__(self, dmm, fe_type):
        super().__init__(dmm, fe_type, fe_type.held)


def broadcast(builder, scalar):
    """Return a vector with an LLVM double in every lane."""
    one = builder.insert_element(
        ir.Constant(DOUBLES, ir.Undefined), scalar, ir.Constant(ir.IntType(32), 0)
    )
    zeros = ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), [0] * WIDTH)
    return builder.shuffle_vector(one, ir.Constant(DOUBLES, ir.Undefined), zeros)


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


def _teach(op, result, arguments, instruction, *first):
    """Teach Numba an operator: instruction of the builder, and its first arguments."""

    @infer_global(op)
    class Template(ConcreteTemplate):
        cases = [signature(result, *arguments)]  # noqa: RUF012  as Numba wants it

    @lower_builtin(op, *arguments)
    def lower(context, builder, sig, args):
        return getattr(builder, instruction)(*first, *args)


for op, inplace, instruction in (
    (operator.add, operator.iadd, "fadd"),
    (operator.sub, operator.isub, "fsub"),
    (operator.mul, operator.imul, "fmul"),
    (operator.truediv, operator.itruediv, "fdiv"),
):
    _teach(op, vector, (vector, vector), instruction)
    _teach(inplace, vector, (vector, vector), instruction)

# as NumPy: a comparison with NaN is false, except "not equal"
for op, instruction, predicate in (
    (operator.lt, "fcmp_ordered", "<"),
    (operator.le, "fcmp_ordered", "<="),
    (operator.gt, "fcmp_ordered", ">"),
    (operator.ge, "fcmp_ordered", ">="),
    (operator.eq, "fcmp_ordered", "=="),
    (operator.ne, "fcmp_unordered", "!="),
):
    _teach(op, mask, (vector, vector), instruction, predicate)

_teach(operator.and_, mask, (mask, mask), "and_")
_teach(operator.or_, mask, (mask, mask), "or_")
_teach(operator.xor, mask, (mask, mask), "xor")
_teach(operator.invert, mask, (mask,), "not_")
_teach(operator.neg, vector, (vector,), "fneg")


@overload(operator.pos)
def positive(x):
    """Return the same."""
    return (lambda x: x) if x is vector else None
