"""Doubles split by their bits into significand and power of two, and joined."""

from __future__ import annotations

from llvmlite import ir
from numba.extending import intrinsic, register_jitable

from tolstat.lanes.elementary import multiply_add
from tolstat.lanes.vector import DOUBLES, WIDTH, vector

# 1.5 2^52: a number added to it is a whole number in the last bits
WHOLE = 6755399441055744.0
WHOLE_BITS = 0x4338000000000000
ROOT_HALF_BITS = 0x3FE6A09E667F3BCD  # sqrt(1/2)
EXPONENT = 52  # bits of the fraction below it
BIAS = 1023

INTEGERS = ir.VectorType(ir.IntType(64), WIDTH)


def each(number):
    """Return an LLVM constant: a whole number in every lane."""
    return ir.Constant(INTEGERS, [number] * WIDTH)


@intrinsic
def as_vector(typingctx, x):
    """Return a vector unchanged, or a plain number in every lane."""

    def codegen(context, builder, sig, args):
        return args[0]

    return vector(vector), codegen


@intrinsic
def exponent_of(typingctx, x):
    """Return k, x = m 2^k with m from sqrt(1/2) to sqrt(2), in the last bits.

    x is normal and above 0; the caller subtracts WHOLE.
    """

    def codegen(context, builder, sig, args):
        above = builder.sub(builder.bitcast(args[0], INTEGERS), each(ROOT_HALF_BITS))
        k = builder.ashr(above, each(EXPONENT))
        return builder.bitcast(builder.add(k, each(WHOLE_BITS)), DOUBLES)

    return vector(vector), codegen


@intrinsic
def significand_of(typingctx, x, k):
    """Return m = x 2^-k; k stands in the last bits, and m is normal."""

    def codegen(context, builder, sig, args):
        bits, k = (builder.bitcast(value, INTEGERS) for value in args)
        power = builder.shl(builder.sub(k, each(WHOLE_BITS)), each(EXPONENT))
        return builder.bitcast(builder.sub(bits, power), DOUBLES)

    return vector(vector, vector), codegen


@intrinsic
def _half_powers(typingctx, n, second):
    """Return 2^(n/2), rounded down, or the rest of 2^n; n in the last bits."""

    def codegen(context, builder, sig, args):
        n = builder.sub(builder.bitcast(args[0], INTEGERS), each(WHOLE_BITS))
        first = builder.ashr(n, each(1))
        power = builder.select(args[1], builder.sub(n, first), first)
        bits = builder.shl(builder.add(power, each(BIAS)), each(EXPONENT))
        return builder.bitcast(bits, DOUBLES)

    return vector(vector, second), codegen


@register_jitable(fastmath=False)
def times_power(x, n):
    """Return x 2^n, rounded once; n stands in the last bits, |n| up to 1100.

    In two factors: each is normal where the result is zero, subnormal or infinite.
    """
    return x * _half_powers(n, False) * _half_powers(n, True)


@register_jitable(fastmath=False)
def fast_two_sum(a, b):
    """Return a + b and its rounding error; |a| >= |b|, or a is zero."""
    total = a + b
    return total, b - (total - a)


@register_jitable(fastmath=False)
def two_product(a, b):
    """Return a b and its rounding error."""
    product = a * b
    return product, multiply_add(a, b, -product)
