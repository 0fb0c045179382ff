"""Vectors, masks, rows and names agree with NumPy, lane by lane."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import types

from tolstat.lanes.compiled import compiled
from tolstat.lanes.rows import named, rows, write
from tolstat.lanes.vector import WIDTH

table = types.float64[:, ::1]
SPECIAL = [0.0, -0.0, 1.5, -2.5, np.inf, -np.inf, np.nan, 1e-310]


class Pair(NamedTuple):
    a: object
    b: object


def everything(x, out):
    """Every operator and elementary function that vectors know."""
    a, b = x[0], x[1]
    values = (
        a + b, a - b, a * b, a / b, -a, +a, 2 - a, a * 3, 1.0 / a,
        np.sqrt(np.abs(a)), np.abs(b), np.floor(a), np.rint(a), np.copysign(a, b),
        np.maximum(a, b), np.minimum(a, b), np.maximum(a, 0.0),
        np.where(a < b, 1.0, 0.0), np.where(a <= b, a, b), np.where(a > b, 1, 2),
        np.where(a >= b, a, 0.0), np.where(a == b, 1.0, 0.0),
        np.where(a != b, 1.0, 0.0), np.where((a < b) & (b > 0.0), 1.0, 0.0),
        np.where((a < b) | (b > 0.0), 1.0, 0.0),
        np.where((a < b) ^ (b > 0.0), 1.0, 0.0), np.where(~(a < b), 1.0, 0.0),
        np.where(np.isfinite(a), 1.0, 0.0),
    )  # fmt: skip
    write(out, 0, values)


compiled_everything = compiled()(everything)


@compiled(types.void(table, table))
def everything_on_lanes(x, out):
    compiled_everything(named(Pair, x), out)


@compiled(types.UniTuple(types.boolean, 3)(table))
def reductions(x):
    v = rows(x)[0]
    return np.any(v > 0.0), np.all(v > 0.0), len(rows(x)) == 2


def test_lanes_agree_with_numpy_bit_by_bit():
    rng = np.random.default_rng(4)
    for trial in range(50):
        x = rng.normal(size=(2, WIDTH)) * 10.0 ** rng.integers(-3, 4, (2, WIDTH))
        if trial < 20:
            x[0] = rng.choice(SPECIAL, WIDTH)
            x[1] = rng.choice(SPECIAL, WIDTH)
        expected, found = np.zeros((28, WIDTH)), np.zeros((28, WIDTH))
        with np.errstate(all="ignore"):
            everything(Pair(*x), expected)
        everything_on_lanes(x, found)
        np.testing.assert_array_equal(found, expected)
        zero = (expected == 0) & (np.arange(28)[:, None] != 0)
        # "nsz" lets the compiler drop the sign of a zero sum, not of a copied zero
        for row in (5, 13):
            np.testing.assert_array_equal(
                np.signbit(found[row][zero[row]]), np.signbit(expected[row][zero[row]])
            )


def test_reductions_and_length():
    x = np.ones((2, WIDTH))
    assert reductions(x) == (True, True, True)
    x[0, WIDTH - 1] = -1.0
    assert reductions(x) == (True, False, True)
    assert reductions(-np.ones((2, WIDTH))) == (False, False, True)


@compiled()
def one_more(x):
    return x + 1.0


def test_functions_compiled_by_users_can_be_called():
    assert one_more(2.0) == 3.0
