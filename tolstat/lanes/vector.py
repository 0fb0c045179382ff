"""The vector of lanes: a Numba type holding one float64 of each of WIDTH trials.

LLVM splits it on processors with narrower registers, so the width is a constant of the
package and not of the processor. Operators of vectors and masks work lane by lane.
"""

from __future__ import annotations

import operator

from llvmlite import ir
from numba.core import types
from numba.core.typeconv import Conversion
from numba.core.typing.templates import ConcreteTemplate, infer_global, signature
from numba.extending import lower_builtin, lower_cast, models, register_model

WIDTH = 8

DOUBLES = ir.VectorType(ir.DoubleType(), WIDTH)
BITS = ir.VectorType(ir.IntType(1), WIDTH)


class VectorType(types.Type):
    """A float64 in every lane."""

    def __init__(self) -> None:
        super().__init__(name=f"lanes({WIDTH})")

    def can_convert_from(self, typingctx, other):
        """Let a plain number stand for the same number in every lane."""
        if isinstance(other, types.Float | types.Integer):
            return Conversion.unsafe  # worst rank: plain arithmetic stays plain
        return None


class MaskType(types.Type):
    """A truth value in every lane."""

    def __init__(self) -> None:
        super().__init__(name=f"mask({WIDTH})")


vector = VectorType()
mask = MaskType()


@register_model(VectorType)
class VectorModel(models.PrimitiveModel):
    """A vector lives in one LLVM value."""

    def __init__(self, dmm, fe_type):
        super().__init__(dmm, fe_type, DOUBLES)


@register_model(MaskType)
class MaskModel(models.PrimitiveModel):
    """A mask lives in one LLVM value."""

    def __init__(self, dmm, fe_type):
        super().__init__(dmm, fe_type, BITS)


def broadcast(builder, scalar):
    """Copy an LLVM double into every lane."""
    one = builder.insert_element(
        ir.Constant(DOUBLES, ir.Undefined), scalar, ir.Constant(ir.IntType(32), 0)
    )
    zeros = ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), [0] * WIDTH)
    return builder.shuffle_vector(one, ir.Constant(DOUBLES, ir.Undefined), zeros)


@lower_cast(types.Float, VectorType)
@lower_cast(types.Integer, VectorType)
def cast_number(context, builder, fromty, toty, val):
    """Broadcast a plain number."""
    return broadcast(builder, context.cast(builder, val, fromty, types.float64))


def _declare(op, result, *arguments):
    """Declare the one signature of an operator."""

    @infer_global(op)
    class Template(ConcreteTemplate):
        cases = [signature(result, *arguments)]  # noqa: RUF012  as Numba wants it


def _arithmetic(op, inplace, instruction):
    for each in (op, inplace):
        _declare(each, vector, vector, vector)

        @lower_builtin(each, vector, vector)
        def lower(context, builder, sig, args):
            return getattr(builder, instruction)(*args)


def _comparison(op, predicate):
    _declare(op, mask, vector, vector)
    # as NumPy: a comparison with NaN is false, except "not equal"
    method = "fcmp_unordered" if predicate == "!=" else "fcmp_ordered"

    @lower_builtin(op, vector, vector)
    def lower(context, builder, sig, args):
        return getattr(builder, method)(predicate, *args)


def _logic(op, instruction):
    _declare(op, mask, mask, mask)

    @lower_builtin(op, mask, mask)
    def lower(context, builder, sig, args):
        return getattr(builder, instruction)(*args)


_arithmetic(operator.add, operator.iadd, "fadd")
_arithmetic(operator.sub, operator.isub, "fsub")
_arithmetic(operator.mul, operator.imul, "fmul")
_arithmetic(operator.truediv, operator.itruediv, "fdiv")

_comparison(operator.lt, "<")
_comparison(operator.le, "<=")
_comparison(operator.gt, ">")
_comparison(operator.ge, ">=")
_comparison(operator.eq, "==")
_comparison(operator.ne, "!=")

_logic(operator.and_, "and_")
_logic(operator.or_, "or_")
_logic(operator.xor, "xor")

_declare(operator.neg, vector, vector)
_declare(operator.pos, vector, vector)
_declare(operator.invert, mask, mask)


@lower_builtin(operator.neg, vector)
def lower_neg(context, builder, sig, args):
    """Flip the sign of every lane, also of zeros and NaN."""
    return builder.fneg(args[0])


@lower_builtin(operator.pos, vector)
def lower_pos(context, builder, sig, args):
    """Leave every lane as it is."""
    return args[0]


@lower_builtin(operator.invert, mask)
def lower_invert(context, builder, sig, args):
    """Invert every truth value."""
    return builder.xor(args[0], ir.Constant(BITS, [1] * WIDTH))
