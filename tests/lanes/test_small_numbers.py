"""expm1, log1p and tanh of vectors against 300 bits of mpmath, and special values."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest
from numba import types

import tolstat
from tolstat.lanes.compiled import compiled
from tolstat.lanes.rows import rows, write
from tolstat.lanes.vector import WIDTH
from tolstat.moving import Motion, Part, Response, State

ULP = 4.0
EXACT = {"expm1": mpmath.expm1, "log1p": mpmath.log1p, "tanh": mpmath.tanh}
table = types.float64[:, ::1]


@compiled(types.void(table, table))
def all_rows(x, out):
    v = rows(x)[0]
    write(out, 0, (np.expm1(v), np.log1p(v), np.tanh(v)))


def on_lanes(x):
    """Return the functions by name."""
    padded = np.zeros(-(-len(x) // WIDTH) * WIDTH)
    padded[: len(x)] = x
    results = []
    for row in padded.reshape(-1, 1, WIDTH):
        out = np.empty((len(EXACT), WIDTH))
        all_rows(row, out)
        results.append(out)
    columns = np.concatenate(results, axis=1)[:, : len(x)]
    return dict(zip(EXACT, columns, strict=True))


@pytest.mark.parametrize("name", EXACT)
def test_small_numbers_keep_their_digits(name):
    rng = np.random.default_rng(4)
    x = np.concatenate(
        [
            rng.choice([-1.0, 1.0], 2000) * 10 ** rng.uniform(-300, -0.1, 2000),
            rng.choice([-1.0, 1.0], 2000) * 10 ** rng.uniform(-17, -0.01, 2000),
            rng.uniform(-0.99, 3.0, 1000),
            10 ** rng.uniform(0, 2, 500),
        ]
    )
    worst = 0.0
    with mpmath.workprec(1200):  # of 1 + x
        for value, number in zip(on_lanes(x)[name], x, strict=True):
            true = EXACT[name](mpmath.mpf(float(number)))
            error = (mpmath.mpf(float(value)) - true) / np.spacing(abs(float(true)))
            worst = max(worst, abs(float(error)))
    assert worst <= ULP


@pytest.mark.parametrize("name", EXACT)
def test_special_values_as_numpy(name):
    x = np.array([0.0, -1.0, -2.0, np.inf, -np.inf, np.nan, 5e-324, 800.0, -800.0, 1e9])
    with np.errstate(all="ignore"):
        known = getattr(np, name)(x)
    np.testing.assert_allclose(on_lanes(x)[name], known, rtol=4e-16, atol=5e-324)


class Small(Motion):
    """What is typed with small numbers."""

    lasts = 1.0
    x = State("1", start=1.0, size=1.0)
    a = Part(1e-9, "1")
    e = Response.end("1")
    s = Response.end("1")
    g = Response.end("1")
    h = Response.end("1")
    c = Response.end("1")

    def motion(self, t, y, p):
        return {
            "x": np.tanh(p.a * y.x) / p.a,
            "e": np.expm1(p.a * y.x),
            "s": np.sinh(p.a * y.x),
            "g": np.log1p(p.a * y.x),
            "h": np.arcsin(1.0 - p.a * y.x),
            "c": np.arccos(1.0 - p.a * y.x),
        }


def test_motions_keep_them_too():
    (row,) = tolstat.evaluate(Small, {}, {"rtol": 1e-12}).itertuples()
    small = 1e-9 * np.e
    assert row.e == pytest.approx(small + small**2 / 2, rel=1e-11)
    assert row.g == pytest.approx(small - small**2 / 2, rel=1e-11)
    assert row.s == pytest.approx(small, rel=1e-11)
    angle = np.sqrt(2.0 * small) * (1.0 + small / 12.0)
    assert row.h == pytest.approx(np.pi / 2 - angle, rel=1e-12)
    assert row.c == pytest.approx(angle, rel=1e-11)
