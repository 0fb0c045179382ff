"""Lock-step with SciPy's RK45: state, error estimate and dense output of each step."""

from __future__ import annotations

import numpy as np
from numba import types
from scipy.integrate import RK45
from scipy.integrate._ivp.rk import RkDenseOutput, rk_step

from tests.integrator.conftest import pendulum, pendulum_rates, step_of
from tolstat.integrator.signatures import rates_type, step_type, table, tables
from tolstat.integrator.step import advance, error_of, halfway, interpolate
from tolstat.lanes.compiled import compiled
from tolstat.lanes.rows import rows
from tolstat.lanes.vector import WIDTH


@compiled(types.void(rates_type, table, table, table, table, step_type, table))
def one_step(rates, h, t_new, y, p, step, error):
    y, step, h, t_new = rows(y), rows(step), rows(h)[0], rows(t_new)[0]
    advance(rates, step.moment[0], h, t_new, y, rows(p), step)
    for i in range(len(y)):
        rows(error)[i] = error_of(h, step.k, i)
    halfway(h, y, step.k, step.middle)


@compiled(
    types.float64(types.float64, types.float64, table, tables, types.int64, types.int64)
)
def inside(h, theta, y, k, lane, i):
    return interpolate(h, theta, rows(y), rows(k), lane, i)


def test_each_step_matches_scipy():
    rng = np.random.default_rng(5)
    p = np.ascontiguousarray(rng.uniform(0.5, 2.0, (3, WIDTH)))
    y = np.ascontiguousarray(rng.uniform(-1, 1, (2, WIDTH)))
    t = rng.uniform(0, 1, WIDTH)
    for _ in range(40):
        h = 10 ** rng.uniform(-3, -0.5, WIDTH)
        moment = np.zeros((2, WIDTH))
        moment[0] = t
        k = np.zeros((7, 2, WIDTH))
        pendulum(moment, y, p, k[0])
        y_new, error, middle = (np.zeros((2, WIDTH)) for _ in range(3))
        step = step_of(moment=moment, k=k, middle=middle, end=y_new)
        one_step(pendulum, h[None], (t + h)[None], y, p, step, error)
        for lane in range(WIDTH):

            def rates(t, y, lane=lane):
                return np.array(pendulum_rates(t, y, p[:, lane]))

            K = np.empty((7, 2))
            start, step = y[:, lane].copy(), h[lane]
            expected, last = rk_step(
                rates,
                t[lane],
                start,
                rates(t[lane], start),
                step,
                RK45.A,
                RK45.B,
                RK45.C,
                K,
            )
            size = np.abs(expected).max()
            np.testing.assert_allclose(
                y_new[:, lane], expected, atol=1e-12 * size, rtol=0
            )
            np.testing.assert_allclose(k[6, :, lane], last, atol=1e-12, rtol=0)
            np.testing.assert_allclose(
                error[:, lane], -step * (K.T @ RK45.E), atol=1e-12 * size, rtol=0
            )
            dense = RkDenseOutput(t[lane], t[lane] + step, start, K.T @ RK45.P)
            np.testing.assert_allclose(
                middle[:, lane], dense(t[lane] + step / 2), atol=1e-12, rtol=0
            )
            for theta in (0.0, 0.21, 0.77, 1.0):
                found = [inside(step, theta, y, k, lane, i) for i in range(2)]
                np.testing.assert_allclose(
                    found, dense(t[lane] + theta * step), atol=1e-12, rtol=0
                )
        t, y = t + h, np.ascontiguousarray(y_new)
