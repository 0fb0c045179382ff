"""The vector of lanes: a Numba type holding one float64 of each of WIDTH trials.

LLVM splits it on processors with narrower registers, so the width is a constant of the
package and not of the processor.
"""

from __future__ import annotations

from llvmlite import ir
from numba.core import types
from numba.core.typeconv import Conversion
from numba.extending import lower_cast, models, register_model

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
