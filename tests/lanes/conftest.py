"""Functions of vectors, compiled once for all tests of the lanes."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from numba import types

from tolstat.lanes.compiled import compiled
from tolstat.lanes.rows import rows, write
from tolstat.lanes.vector import WIDTH

table = types.float64[:, ::1]


@compiled(types.void(table, table))
def arctan_rows(x, out):
    X, O = rows(x), rows(out)
    for i in range(len(X)):
        O[i] = np.arctan(X[i])


@compiled(types.void(table, table))
def sin_rows(x, out):
    X, O = rows(x), rows(out)
    for i in range(len(X)):
        O[i] = np.sin(X[i])


@compiled(types.void(table, table))
def cos_rows(x, out):
    X, O = rows(x), rows(out)
    for i in range(len(X)):
        O[i] = np.cos(X[i])


@compiled(types.void(table, table))
def exp_rows(x, out):
    X, O = rows(x), rows(out)
    for i in range(len(X)):
        O[i] = np.exp(X[i])


@compiled(types.void(table, table))
def log_rows(x, out):
    X, O = rows(x), rows(out)
    for i in range(len(X)):
        O[i] = np.log(X[i])


@compiled(types.void(table, table, table))
def power_rows(x, y, out):
    X, Y, O = rows(x), rows(y), rows(out)
    for i in range(len(X)):
        O[i] = np.power(X[i], Y[i])


@compiled(types.void(table, table))
def written_powers(x, out):
    """A vector to plain numbers, a plain number to a vector, and in place."""
    v = rows(x)[0]
    w = v
    w **= v
    write(out, 0, (v**0.9, v**2, 2.0**v, 3**v, w, np.power(v, 0.5)))


def apply(function, *values):
    """Call a compiled function of rows on any number of values."""
    n = len(values[0])
    padded = np.zeros((len(values), -(-n // WIDTH), WIDTH))
    for rows_of_one, each in zip(padded, values, strict=True):
        rows_of_one.ravel()[:n] = each
    out = np.empty_like(padded[0])
    function(*padded, out)
    return out.ravel()[:n]


@pytest.fixture
def on_lanes():
    """Return NumPy's elementary functions on vectors of lanes."""
    compiled_rows = {
        "arctan": arctan_rows,
        "sin": sin_rows,
        "cos": cos_rows,
        "exp": exp_rows,
        "log": log_rows,
        "power": power_rows,
    }
    return {name: partial(apply, each) for name, each in compiled_rows.items()}
