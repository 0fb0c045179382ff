"""Functions of vectors, compiled once for all tests of the lanes."""

from __future__ import annotations

import numpy as np
import pytest
from numba import types

from tolstat.lanes.compiled import compiled
from tolstat.lanes.rows import rows
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


def apply(function, values):
    """Call a compiled function of rows on any number of values."""
    values = np.asarray(values, dtype=np.float64)
    padded = np.zeros((-(-len(values) // WIDTH), WIDTH))
    padded.ravel()[: len(values)] = values
    out = np.empty_like(padded)
    function(padded, out)
    return out.ravel()[: len(values)]


@pytest.fixture
def on_lanes():
    """Return NumPy's arctan, sin and cos on vectors of lanes."""
    return {
        "arctan": lambda x: apply(arctan_rows, x),
        "sin": lambda x: apply(sin_rows, x),
        "cos": lambda x: apply(cos_rows, x),
    }
