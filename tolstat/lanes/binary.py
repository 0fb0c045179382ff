"""Building blocks of elementary functions: polynomials, and the bits of doubles."""

from llvmlite import ir
from numba.extending import overload, register_jitable

from tolstat.lanes.vector import (
    DOUBLES,
    WIDTH,
    call,
    instructions,
    multiply_add,
    vector,
)

STRICT = {"fastmath": False}

# 1.5 2^52: a number added to it is a whole number in the last bits
WHOLE = 6755399441055744.0
WHOLE_BITS = 0x4338000000000000
ROOT_HALF_BITS = 0x3FE6A09E667F3BCD  # sqrt(1/2)
EXPONENT = 52  # bits of the fraction below it
BIAS = 1023

INTEGERS = ir.VectorType(ir.IntType(64), WIDTH)


def on_vectors(function):
    """Return a decorator: what it decorates is compiled as `function` of a vector."""

    def decorate(implementation):
        @overload(function, jit_options=STRICT)
        def typed(x):
            return implementation if x is vector else None

        return implementation

    return decorate


def in_all_lanes(number):
    """Return an LLVM constant with a whole number in every lane."""
    return ir.Constant(INTEGERS, [number] * WIDTH)


def horner(*coefficients):
    """Return a polynomial of vectors, from its coefficients, the constant first."""
    *others, last = (ir.Constant(DOUBLES, [number] * WIDTH) for number in coefficients)

    @instructions(vector, vector)
    def polynomial(builder, x):
        value = last
        for coefficient in reversed(others):
            value = call(builder, "fma", x, value, coefficient)
        return value

    return polynomial


def two_chains(*coefficients):
    """Return the polynomial of `horner` in two interleaved chains: half the latency."""
    pairs = [*zip(coefficients[::2], coefficients[1::2], strict=True)]
    *others, last = (tuple(ir.Constant(DOUBLES, [n] * WIDTH) for n in p) for p in pairs)

    @instructions(vector, vector)
    def polynomial(builder, x):
        u, (even, odd) = builder.fmul(x, x), last
        for a, b in reversed(others):
            even = call(builder, "fma", u, even, a)
            odd = call(builder, "fma", u, odd, b)
        return call(builder, "fma", x, odd, even)

    return polynomial


@instructions(vector, vector)
def as_vector(builder, x):
    """Return a vector unchanged, or a plain number in every lane."""
    return x


@instructions(vector, vector)
def exponent_of(builder, x):
    """Return k, x = m 2^k with m from sqrt(1/2) to sqrt(2), in the last bits.

    x is normal and above 0; the caller subtracts WHOLE.
    """
    above = builder.sub(builder.bitcast(x, INTEGERS), in_all_lanes(ROOT_HALF_BITS))
    k = builder.ashr(above, in_all_lanes(EXPONENT))
    return builder.bitcast(builder.add(k, in_all_lanes(WHOLE_BITS)), DOUBLES)


@instructions(vector, vector, vector)
def significand_of(builder, x, k):
    """Return m = x 2^-k; k is in the last bits, and m is normal."""
    bits, k = (builder.bitcast(value, INTEGERS) for value in (x, k))
    power = builder.shl(
        builder.sub(k, in_all_lanes(WHOLE_BITS)), in_all_lanes(EXPONENT)
    )
    return builder.bitcast(builder.sub(bits, power), DOUBLES)


@instructions(vector, vector, vector)
def times_power(builder, x, n):
    """Return x 2^n, rounded once; n is in the last bits, |n| up to 1100.

    Two factors are used: each is normal if the result is zero, subnormal or infinite.
    """
    n = builder.sub(builder.bitcast(n, INTEGERS), in_all_lanes(WHOLE_BITS))
    half = builder.ashr(n, in_all_lanes(1))
    for power in (half, builder.sub(n, half)):
        bits = builder.shl(
            builder.add(power, in_all_lanes(BIAS)), in_all_lanes(EXPONENT)
        )
        x = builder.fmul(x, builder.bitcast(bits, DOUBLES))
    return x


@register_jitable(**STRICT)
def fast_two_sum(a, b):
    """Return a + b and its rounding error; |a| >= |b|, or a is zero."""
    total = a + b
    return total, b - (total - a)


@register_jitable(**STRICT)
def two_product(a, b):
    """Return a b and its rounding error."""
    product = a * b
    return product, multiply_add(a, b, -product)
