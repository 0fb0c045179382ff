"""Step loads of the rolling block by the second and core: tolstat against heyoka.

    pip install heyoka
    python -m tests.studies.benchmarks.drive

Both follow the same drives of runs/rolling-block.toml through their step loads of one
second, by the same equations. The error is that of the elastic moments at 50 times,
against the modal closed form, in units of the greatest moment in that link. heyoka
runs at the loosest of its tolerances at which it errs no more than a bound. tolstat
solves the eigenvalue problem of each drive, too, and finds the peaks; by Runge-Kutta
it runs at its loosest rtol. Seconds are those of the processor, without compilation
and without samples; of five repeats side by side the median counts.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from statistics import median

import numpy as np
from numpy.typing import NDArray

from tests.conftest import ROOT
from tests.studies.benchmarks.engines import REPEATS, seconds
from tolstat.machines.rolling_block.declarations import Settings
from tolstat.machines.rolling_block.modes import (
    Drive,
    Modes,
    contributions,
    drives,
    modes_of,
    moments,
)
from tolstat.machines.rolling_block.motion import (
    Loading,
    equations,
    followed,
    load_steps,
)
from tolstat.machines.rolling_block.structure import LINKS, STANDS
from tolstat.study.study import load

Array = NDArray[np.float64]
Run = Callable[[], Array]

M = len(LINKS)
DRIVES, MANY = 256, 2000
BOUNDS = (1e-6, 1e-9)  # of the error
END = np.array([])
TIMES = np.linspace(0.02, 1.0, 50)  # s


class Drives:
    """What is followed: drives, their modes, their loads."""

    def __init__(self, n: int) -> None:
        study = load(ROOT / "runs" / "rolling-block.toml")
        settings = study.settings
        assert isinstance(settings, Settings)
        self.settings = settings
        self.built = drives(study.deviations()[:n], settings)
        self.modes = self.built.modes
        self.loading: Loading = load_steps(settings)

    def part(self, rows: slice) -> Drive:
        """Return some of them."""
        modes = Modes(*(each[rows] for each in self.modes))
        return Drive(*(each[rows] for each in self.built[:3]), modes)

    def truth(self) -> Array:
        """Return their moments in closed form, float64[drive, link, time], N m."""
        built, modes = self.built, self.modes
        steps = [
            (when, contributions(modes, built.C, {stand: 0.25, 1: 0.25}))
            for when, stand in zip(self.settings.entries, STANDS, strict=True)
        ]
        return moments(TIMES, modes.omega, built.zeta, steps)


def tolstat(given: Drives, settings: Settings, times: Array) -> Run:
    """Follow them by this engine, modes and peaks included."""

    def run() -> Array:
        Q, C, zeta, _ = given.built
        built = Drive(Q, C, zeta, modes_of(Q, C))
        found = followed(built, given.loading, settings, times)
        twists = found.history[:, :, :M].transpose(0, 2, 1)
        return given.built.C[:, :, None] * twists

    return run


def heyoka(given: Drives, tolerance: float, times: Array) -> Run:
    """Follow them by Taylor series, a drive in each lane; the loads step at marks."""
    import heyoka as hy

    lanes = hy.recommended_simd_size()
    y = hy.make_vars(*(f"y{i}" for i in range(2 * M)))
    # the moments are parameters, changed between two phases
    stiffness, damping, load = equations(given.built, given.loading)
    matrices = np.concatenate([stiffness, damping], axis=2)
    table = np.concatenate([matrices.reshape(len(load), -1), load[:, 0]], axis=1).T
    first_load = 2 * M * M
    pulls = [
        hy.sum([hy.par[2 * M * i + j] * y[j] for j in range(2 * M)]) for i in range(M)
    ]
    speeds = [hy.par[first_load + i] - pulls[i] for i in range(M)]
    taylor = hy.taylor_adaptive_batch(
        list(zip(y, [*y[M:], *speeds], strict=True)),
        np.zeros((2 * M, lanes)),
        pars=np.zeros((len(table), lanes)),
        tol=tolerance,
    )
    begins = given.loading.marks[:-1]

    def batch(first: int) -> Array:
        found = np.empty((len(times), M, lanes))
        taylor.set_time(0.0)
        taylor.state[:] = 0.0
        taylor.pars[:] = table[:, first : first + lanes]
        for when in sorted({*begins, *times, 1.0}):
            taylor.propagate_until([when] * lanes)
            if when in begins:
                of_phase = load[first : first + lanes, begins.index(when)]
                taylor.pars[first_load:] = of_phase.T
            found[np.equal(times, when)] = taylor.state[:M]
        twists = found.transpose(2, 1, 0)
        return given.built.C[first : first + lanes, :, None] * twists

    return lambda: np.concatenate([batch(i) for i in range(0, len(load), lanes)])


def error(found: Array, truth: Array) -> float:
    """Return the worst error of a moment over the greatest in its link."""
    greatest = np.abs(truth).max(axis=2, keepdims=True)
    return float(np.max(np.abs(found - truth) / greatest))


def side_by_side(given: Drives, bound: float) -> None:
    """Print how fast the exact solution, Runge-Kutta and heyoka are within a bound."""
    truth = given.truth()
    settings = given.settings
    exact = error(tolstat(given, settings, TIMES)(), truth)
    for exponent in range(4, 17):
        tolerance = 10.0**-exponent
        if (met := error(heyoka(given, tolerance, TIMES)(), truth)) <= bound:
            break
    for second in range(4, 17):
        stepped = replace(settings, runge_kutta=True, rtol=10.0**-second)
        if (off := error(tolstat(given, stepped, TIMES)(), truth)) <= bound:
            break
    runs = (
        tolstat(given, settings, END), tolstat(given, stepped, END),
        heyoka(given, tolerance, END), tolstat(given, settings, TIMES),
        heyoka(given, tolerance, TIMES),
    )  # fmt: skip
    took = np.array([[seconds(run) for run in runs] for _ in range(REPEATS)])
    rates = DRIVES / np.median(took, axis=0)
    faster = np.median(took[:, [1, 2, 4]] / took[:, [0, 0, 3]], axis=0)
    print(
        f"bound {bound:.0e}: exact, error {exact:.0e}: {rates[0]:.0f}/s; Runge-Kutta, "
        f"rtol 1e-{second}, error {off:.1e}: {rates[1]:.0f}/s; heyoka, tolerance "
        f"1e-{exponent}, error {met:.1e}: {rates[2]:.0f}/s. Exact is {faster[0]:.1f} "
        f"and {faster[1]:.1f} times as fast; with 50 samples {rates[3]:.0f}/s, "
        f"{faster[2]:.1f} times as fast as heyoka"
    )


def by_two_threads(given: Drives) -> None:
    """Print the seconds of them all, without samples, as the machine follows them."""

    def part(rows: slice) -> None:
        followed(given.part(rows), given.loading, given.settings)

    half, walls = MANY // 2, []
    for _ in range(REPEATS):
        began = time.perf_counter()
        with ThreadPoolExecutor(2) as executor:
            list(executor.map(part, (slice(half), slice(half, MANY))))
        walls.append(time.perf_counter() - began)
    print(f"{MANY} drives by two threads: {median(walls):.2f} s")


def main() -> None:
    """Print the lines."""
    few, many = Drives(DRIVES), Drives(MANY)
    for bound in BOUNDS:
        side_by_side(few, bound)
    by_two_threads(many)


if __name__ == "__main__":
    main()
