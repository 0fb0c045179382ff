"""Rings a second on one core: tolstat's engine beside SciPy's RK45 and LSODA.

    python -m tests.studies.benchmarks.ring

The same machines of runs/ring.toml, 3 s each, N = 6. Each engine runs at the loosest
tolerance of 1e-2, 1e-3, ... at which the smallest depth of cut of every machine is
right to 1e-4 mm. SciPy gets the states' scales times its tolerance as absolute
tolerance, and the same equations as matrices, compiled by Numba; it leaves the static
depth, the critical speeds and the growth out, and finds the smallest depth on 3001
points of its dense output. Seconds are those of the processor, without compilation.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from tests.studies.benchmarks.accuracy import machines as drawn
from tolstat.machines.ring.harmonics import harmonics, inverse
from tolstat.machines.ring.linear import ring_matrix
from tolstat.machines.ring.parameters import build, scale_of
from tolstat.study.study import Study, load

Array = NDArray[np.float64]
TRIALS, FEW, BOUND = 512, 4, 1e-7  # machines; of slow engines; m
NOTHING = 3e-14  # the relative tolerance, where the scales alone are to decide


@njit(error_model="numpy")
def rates(t, y, A, push_R, push_T, sees, force, e):
    """Matrices of ring and tool, then the forces at the depth of cut."""
    t_R = force[4] + np.dot(sees, y)
    for k in range(len(e)):
        t_R += e[k, 1] * np.cos(e[k, 0] * t) + e[k, 2] * np.sin(e[k, 0] * t)
    dy = np.dot(A, y)
    if t_R > 0.0:
        mm = 1e3 * t_R
        dy -= (force[0] * mm ** force[1]) * push_R
        dy -= (force[2] * mm ** force[3]) * push_T
    return dy


def systems(deviations: Array, settings: object) -> list[tuple[Array, ...]]:
    """Return what `rates` takes of each machine."""
    r = build(deviations, settings)
    n = r.on.s.shape[1]
    C = harmonics(n + 1).C
    A = np.zeros((len(r.nu), 4 * n + 2, 4 * n + 2))
    A[:, : 4 * n, : 4 * n] = ring_matrix(r, r.Omega, settings.hoop)
    A[:, 4 * n, 4 * n + 1] = 1.0
    A[:, 4 * n + 1, 4 * n] = -r.K_C / r.m_c
    A[:, 4 * n + 1, 4 * n + 1] = -r.c_c / r.m_c
    push = np.zeros((2, len(r.nu), 4 * n + 2))
    for i, (a, b) in enumerate(
        ((r.tool_place.u_a, r.tool_place.u_b), (r.tool_place.v_a, r.tool_place.v_b))
    ):
        push[i, :, 2 * n : 3 * n] = (inverse(r.on.s, C) @ a[..., None])[
            ..., 0
        ] / r.pi_chi[:, None]
        push[i, :, 3 * n : 4 * n] = (inverse(r.on.t, C) @ b[..., None])[
            ..., 0
        ] / r.pi_chi[:, None]
    push[0, :, 4 * n + 1] = 1.0 / r.m_c
    sees = np.zeros((len(r.nu), 4 * n + 2))
    sees[:, : 2 * n] = np.hstack([r.tool_place.u_a, r.tool_place.u_b])
    sees[:, 4 * n] = 1.0
    found = []
    for i in range(len(r.nu)):
        force = np.array([r.c_R[i], r.x_R[i], r.c_T[i], r.x_T[i], r.t_R0[i]])
        lobes = [
            (k * r.Omega[i], r.e_cos[i, j], r.e_sin[i, j])
            for j, k in enumerate(r.lobes)
            if r.e_cos[i, j] or r.e_sin[i, j]
        ]
        e = np.array(lobes).reshape(-1, 3)
        found.append((A[i], push[0, i], push[1, i], sees[i], force, e))
    return found


def lowest(values: Array) -> float:
    """Return the least of a smooth curve: by the parabola through its three lowest."""
    i = int(np.clip(values.argmin(), 1, len(values) - 2))
    a, m, b = values[i - 1 : i + 2]
    return float(m - 0.125 * (b - a) ** 2 / (a - 2.0 * m + b))


def scipy_engine(method: str) -> Callable[[Array, Study, float], Array]:
    """Make one of SciPy's engines: smallest depths, m."""

    def engine(deviations: Array, study: Study, rtol: float) -> Array:
        s = study.settings
        scale, at = scale_of(s), np.linspace(0.0, s.duration, 3001)
        found = []
        for arguments in systems(deviations, s):
            _, _, _, sees, force, e = arguments
            y = solve_ivp(
                rates, (0.0, s.duration), np.zeros(len(scale)), method=method,
                t_eval=at, rtol=NOTHING, atol=rtol * scale, args=arguments,
            ).y  # fmt: skip
            t_R = force[4] + sees @ y
            for speed, cos, sin in e:
                t_R = t_R + cos * np.cos(speed * at) + sin * np.sin(speed * at)
            found.append(lowest(t_R))
        return np.array(found)

    return engine


def tolstat(deviations: Array, study: Study, rtol: float, **more: float) -> Array:
    """Run this engine, all responses included."""
    settings = replace(study.settings, rtol=rtol, **more)
    found: Array = study.model.evaluate(deviations, settings).responses[:, 0]
    return found


def main() -> None:
    """Print the lines."""
    study = load("runs/ring.toml")
    machines = drawn(study, TRIALS)
    truth = tolstat(machines, study, 1e-11, max_step=5e-4)
    cores = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {max(cores)})
    print(
        f"{'engine':<16} {'rtol':>6} {'machines':>8} {'error, mm':>10} {'rings/s':>8}"
    )

    def line(name: str, engine: Callable[..., Array], n: int, rtol: float) -> bool:
        took = []
        for _ in range(3 if n > FEW else 1):
            began = time.process_time()
            found = engine(machines[:n], study, rtol)
            took.append(time.process_time() - began)
        off = np.abs(found - truth[:n]).max()
        met = bool(off <= BOUND)
        if met:
            print(
                f"{name:<16} {rtol:6.0e} {n:8d} {1e3 * off:10.1e} {n / min(took):8.1f}"
            )
        return met

    line("tolstat, default", tolstat, TRIALS, study.settings.rtol)
    for name in ("RK45", "LSODA"):
        engine = scipy_engine(name)
        engine(machines[:1], study, 1e-2)
        for exponent in range(2, 10):
            if line(f"SciPy {name}", engine, FEW, 10.0**-exponent):
                break
    os.sched_setaffinity(0, cores)
    blocks = np.array_split(machines, 8)

    def both(workers: int) -> float:
        began = time.perf_counter()
        with ThreadPoolExecutor(workers) as executor:
            list(executor.map(lambda b: tolstat(b, study, study.settings.rtol), blocks))
        return TRIALS / (time.perf_counter() - began)

    rates_of = {workers: max(both(workers) for _ in range(4)) for workers in (1, 2)}
    print(", ".join(f"{n} workers: {rate:.0f} rings/s" for n, rate in rates_of.items()))


if __name__ == "__main__":
    main()
