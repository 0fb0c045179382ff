"""Arithmetic, comparison and logic of vectors and masks, lane by lane."""

from __future__ import annotations

import operator

from llvmlite import ir
from numba.core.typing.templates import ConcreteTemplate, infer_global, signature
from numba.extending import lower_builtin

from tolstat.lanes.vector import BITS, WIDTH, mask, vector


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
