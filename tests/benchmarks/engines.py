"""Trajectories per second and core: tolstat's engine against SciPy's and numbalsoda's.

    pip install numbalsoda     # optional; needs a Fortran compiler
    python -m tests.benchmarks.engines

All integrate the same 64 machines of runs/khpt75.toml with the same compiled right-hand
side. Each runs at the loosest tolerance of 1e-2, 1e-3, ... at which its energies meet
the accuracy bounds (each energy to 1e-4 of the drive energy, extra_loss and
extra_loss_run to 5e-5). Five interleaved repeats; the median of the ratios counts.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
from numba import carray, cfunc, njit, types
from numba.np.unsafe.ndarray import to_fixed_tuple
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from tests.benchmarks.accuracy import ENERGIES, STUDY, Responses, machines
from tolstat.machines.stand import motion as equations
from tolstat.machines.stand import parameters
from tolstat.machines.stand.declarations import CONTRIBUTORS
from tolstat.machines.stand.machine import END, WINDOW, marks_of, start_of
from tolstat.machines.stand.motion import SCALE, Moment, State
from tolstat.machines.stand.parameters import Parameters
from tolstat.study.study import load

Array = NDArray[np.float64]
Engine = Callable[[float], Responses]
TRIALS, REPEATS = 64, 5
N, Q = len(SCALE), len(ENERGIES)
# what SciPy's engines measure the states by: elastic deflections and their speeds
SIZES = State(3e-4, 3e-4, 1e-3, 1e-3, 3e-2, 3e-2, 1e-1, 1e-1)
N_PARAMETERS = len(Parameters._fields)

study = load(STUDY)
deviations = machines(study, TRIALS)
marks = marks_of(study.settings)
named = {c.name: deviations[:, i] for i, c in enumerate(CONTRIBUTORS)}
p = parameters.build(named, study.settings)
table = np.stack(p, axis=1)
start = np.hstack([start_of(p, study.settings), np.zeros((TRIALS, Q))])

scalar_motion = njit(fastmath={"contract", "nsz", "arcp"}, error_model="numpy")(
    equations.motion
)


@njit(error_model="numpy")
def right_hand_side(t, y, row, dy):
    """Evaluate one machine in plain doubles: states, then energies."""
    p = Parameters(*to_fixed_tuple(row, N_PARAMETERS))
    at = scalar_motion(
        Moment(t, 0.0),
        State(y[0], y[1], y[2], y[3], y[4], y[5], y[6], y[7]),
        p,
    )
    i = 0
    for value in at.derivative:
        dy[i] = value
        i += 1
    for value in at.powers:
        dy[i] = value
        i += 1


@njit(types.float64[::1](types.float64, types.float64[::1], types.float64[::1]))
def for_scipy(t, y, row):
    """Give SciPy its right-hand side."""
    dy = np.empty(len(y))
    right_hand_side(t, y, row, dy)
    return dy


@cfunc(
    types.void(
        types.float64, types.CPointer(types.double), types.CPointer(types.double),
        types.CPointer(types.double),
    )
)  # fmt: skip
def for_lsoda(t, y, dy, row):
    """Give numbalsoda its right-hand side."""
    right_hand_side(
        t, carray(y, (N + Q,)), carray(row, (N_PARAMETERS,)),
        carray(dy, (N + Q,)),
    )  # fmt: skip


def responses(energy: Array) -> Responses:
    """Turn energies at the marks, float64[trial, mark, energy], into responses."""
    window = energy[:, END] - energy[:, WINDOW]
    found = {f"{e}_energy": window[:, i] for i, e in enumerate(ENERGIES)}
    run = energy[:, END]
    found["extra_loss"] = window[:, 2] / window[:, 0]
    found["extra_loss_run"] = run[:, 2] / run[:, 0]
    return found


def error(found: Responses, truth: Responses) -> float:
    """Return the worst error in units of its bound."""
    drive = truth["drive_energy"]
    worst = [
        np.max(np.abs(found[f"{e}_energy"] - truth[f"{e}_energy"]) / drive) / 1e-4
        for e in ENERGIES
    ]
    for name in ("extra_loss", "extra_loss_run"):
        worst.append(np.max(np.abs(found[name] - truth[name])) / 5e-5)
    return float(max(worst))


def tolstat(rtol: float) -> Responses:
    """Run this engine, run-out, peaks and shares included."""
    settings = replace(study.settings, rtol=rtol)
    values = study.model.evaluate(deviations, settings).responses
    names = [response.name for response in study.description.responses]
    return dict(zip(names, values.T, strict=True))


def scipy_engine(method: str) -> Engine:
    """Run one of SciPy's engines; energies get a scale that never steers its step."""
    atol = np.array([*SIZES, *[1e30] * Q])

    def run(rtol: float) -> Responses:
        energy = np.empty((TRIALS, len(marks), Q))
        for i in range(TRIALS):
            found = solve_ivp(
                for_scipy, (0, marks[-1]), start[i], method=method, t_eval=marks,
                rtol=3e-14, atol=rtol * atol, max_step=1e-3, args=(table[i],),
            )  # fmt: skip
            energy[i] = found.y[N:].T
        return responses(energy)

    return run


def numbalsoda_engine() -> Engine | None:
    """Run numbalsoda's LSODA; it has one absolute tolerance for all states."""
    try:
        from numbalsoda import lsoda
    except ImportError:
        return None
    address = for_lsoda.address

    def run(rtol: float) -> Responses:
        energy = np.empty((TRIALS, len(marks), Q))
        for i in range(TRIALS):
            states, success = lsoda(
                address, start[i], marks, table[i], rtol=rtol, atol=rtol * 1e-3,
                mxstep=10_000_000,
            )  # fmt: skip
            energy[i] = states[:, N:] if success else np.nan
        return responses(energy)

    return run


def loosest(engine: Engine, truth: Responses) -> tuple[float, float]:
    """Find the loosest tolerance that meets the bounds, and its error."""
    for exponent in range(2, 12):
        rtol = 10.0**-exponent
        off = error(engine(rtol), truth)
        if off <= 1.0:
            return rtol, off
    raise RuntimeError("no tolerance meets the bounds")


def main() -> None:
    """Print the table."""
    truth = tolstat_truth()
    engines: dict[str, Engine] = {"tolstat": tolstat}
    if peer := numbalsoda_engine():
        engines["numbalsoda LSODA"] = peer
    engines["SciPy LSODA"] = scipy_engine("LSODA")
    engines["SciPy RK45"] = scipy_engine("RK45")
    tolerances = {}
    for name, engine in engines.items():
        tolerances[name] = loosest(engine, truth)
        print(f"{name}: rtol {tolerances[name][0]:.0e} is enough", flush=True)
    default = study.settings.rtol
    engines["tolstat, default"] = tolstat
    tolerances["tolstat, default"] = default, error(tolstat(default), truth)
    rates: dict[str, list[float]] = {name: [] for name in engines}
    for _ in range(REPEATS):
        for name, engine in engines.items():
            began = time.perf_counter()
            engine(tolerances[name][0])
            rates[name].append(TRIALS / (time.perf_counter() - began))
    print(f"{'engine':<18} {'rtol':>6} {'error/bound':>11} {'traj/s':>8} {'ratio':>7}")
    for name in engines:
        ratio = statistics.median(
            a / b for a, b in zip(rates["tolstat"], rates[name], strict=True)
        )
        rtol, off = tolerances[name]
        rate = statistics.median(rates[name])
        print(f"{name:<18} {rtol:6.0e} {off:11.2f} {rate:8.1f} {ratio:7.1f}")
    two_workers()


def tolstat_truth() -> Responses:
    """Return the responses at rtol 1e-9 and a step limit of 1e-4 s."""
    settings = replace(study.settings, rtol=1e-9, max_step=1e-4)
    values = study.model.evaluate(deviations, settings).responses
    names = [response.name for response in study.description.responses]
    return dict(zip(names, values.T, strict=True))


def two_workers() -> None:
    """Compare two threads with one, on blocks of 64."""
    many = machines(study, 8 * TRIALS)
    blocks = np.split(many, 8)

    def evaluate(block: Array) -> None:
        study.model.evaluate(block, study.settings)

    ratios = []
    for _ in range(REPEATS):
        seconds = []
        for workers in (1, 2):
            with ThreadPoolExecutor(workers) as executor:
                began = time.perf_counter()
                list(executor.map(evaluate, blocks))
                seconds.append(time.perf_counter() - began)
        ratios.append(seconds[0] / seconds[1])
    print(f"two workers: {statistics.median(ratios):.2f} times one")


if __name__ == "__main__":
    main()
