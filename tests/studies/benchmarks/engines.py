"""Trajectories per second and core: tolstat's engine against others.

    pip install heyoka diffrax numbalsoda     # each is optional
    python -m tests.studies.benchmarks.engines --picture tests/studies/benchmarks/engines.svg

All integrate the same 64 machines of runs/khpt75.toml by the same equations, on one
core. Each runs at the loosest tolerance of 1e-2, 1e-3, ... at which its energies meet
the accuracy bounds (each energy to 1e-4 of the drive energy, extra_loss and
extra_loss_run to 5e-5); for the picture at two closer ones, too. Where 64 machines
would take longer than 20 s the first eight are run: of fewer machines the worst error
is smaller. Seconds are those of the processor, all threads together, without
compilation: what else runs on the machine counts little. Up to five repeats, each
beside one of tolstat's default settings; the median of the ratios counts.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from statistics import median
from typing import NamedTuple

import numpy as np

from tests.studies.benchmarks.accuracy import ENERGIES, STUDY, Responses
from tests.studies.benchmarks.accuracy import machines as drawn
from tests.studies.benchmarks.peers import (
    PEERS,
    Engine,
    Machines,
    scipy_engine,
    tolstat,
)
from tolstat.study.study import load

TRIALS, FEW, REPEATS = 64, 8, 5
SLOW = 20.0  # s, for all machines; beyond it there are few, and fewer repeats
PLAIN = {
    "model": "stand",
    "trials": FEW,
    "seed": 75,
    "settings": {"contact_yaw": "fig4"},  # 5.8e-4 rad
    "deviations": {"crank_difference": "+-1 mm"},  # normal
}


class Point(NamedTuple):
    """An engine at a tolerance: how many machines, their worst error, how fast."""

    rtol: float
    n: int
    error: float  # in units of its bound
    rate: float  # trajectories a second


def error(found: Responses, truth: Responses) -> float:
    """Return the worst error in units of its bound; NaN where a machine failed."""
    n = len(found["extra_loss"])
    bounds = {f"{e}_energy": 1e-4 * truth["drive_energy"][:n] for e in ENERGIES}
    bounds["extra_loss"] = bounds["extra_loss_run"] = np.array(5e-5)
    each = [np.abs(found[x] - truth[x][:n]) / bounds[x] for x in bounds]
    return float(np.max([np.max(off) for off in each]))


def seconds(
    run: Callable[[], object], clock: Callable[[], float] = time.process_time
) -> float:
    """Time it."""
    began = clock()
    run()
    return clock() - began


def measured(
    engine: Engine, machines: Machines, truth: Responses, rtol: float
) -> Point:
    """Run an engine at a tolerance on few machines, on all if it is quick."""
    for n in (FEW, len(machines)):
        run = engine(machines.first(n), rtol)
        began = time.process_time()
        found = run()
        took = time.process_time() - began
        if took * len(machines) > SLOW * n:
            break
    return Point(rtol, n, error(found, truth), n / took)


def ladder(
    engine: Engine, machines: Machines, truth: Responses, closer: int
) -> tuple[list[Point], Point]:
    """Tighten until the bounds are met, and further; return all, and who met them."""
    points: list[Point] = []
    met: list[Point] = []
    for exponent in range(2, 12):
        points.append(measured(engine, machines, truth, 10.0**-exponent))
        met += [points[-1]] if met or points[-1].error <= 1.0 else []
        if len(met) > closer:
            return points, met[0]
    raise RuntimeError("no tolerance meets the bounds")


def beside(engine: Engine, point: Point, machines: Machines) -> tuple[float, float]:
    """Repeat beside tolstat's default; return the rate and how much slower it is."""
    run = engine(machines.first(point.n), point.rtol)
    own = tolstat(machines, machines.study.settings.rtol)
    rates, ratios = [], []
    for _ in range(REPEATS if point.n / point.rate < 5.0 else 2):
        rates.append(point.n / seconds(run))
        ratios.append(len(machines) / seconds(own) / rates[-1])
    return median(rates), median(ratios)


def table(machines: Machines, closer: int) -> dict[str, list[Point]]:
    """Print the table; return every engine's points."""
    truth = tolstat(machines, 1e-9, max_step=1e-4)()
    print(f"{'engine':<18} {'rtol':>6} {'machines':>8} {'error/bound':>11}", end="")
    print(f" {'traj/s':>8} {'tolstat is faster':>17}")
    default = measured(tolstat, machines, truth, machines.study.settings.rtol)
    print_line("tolstat, default", default, *beside(tolstat, default, machines))
    lines = {}
    makers: dict[str, Callable[[], Engine]] = {"tolstat": lambda: tolstat, **PEERS}
    for name, maker in makers.items():
        try:
            engine = maker()
            lines[name], point = ladder(engine, machines, truth, closer)
            print_line(name, point, *beside(engine, point, machines))
        except Exception as problem:  # one engine less, whatever it is
            print(f"{name:<18} left out: {type(problem).__name__}: {problem}"[:88])
    return lines


def print_line(name: str, point: Point, rate: float, ratio: float) -> None:
    """Print a line of the table."""
    print(
        f"{name:<18} {point.rtol:6.0e} {point.n:8d} {point.error:11.2f} {rate:8.1f} "
        f"{ratio:17.1f}",
        flush=True,
    )


def plain() -> None:
    """Compare the default settings with SciPy's RK45 where one deviation is drawn."""
    study = load(PLAIN)
    machines = Machines(study, study.deviations())
    truth = tolstat(machines, 1e-9, max_step=1e-4)()
    peer = measured(scipy_engine("RK45"), machines, truth, 1e-4)
    many = Machines(study, drawn(study, TRIALS))
    # of 64 machines no lane is idle; the truth is that of eight
    off = error(tolstat(machines, study.settings.rtol)(), truth)
    rate = TRIALS / seconds(tolstat(many, study.settings.rtol))
    print(
        f"plain case: tolstat, default: {rate:.0f}/s, error/bound {off:.2f}; "
        f"SciPy RK45, rtol 1e-4: {peer.rate:.2f}/s, {peer.error:.2f}; "
        f"{rate / peer.rate:.0f} times"
    )


def two_workers(machines: Machines) -> None:
    """Compare two threads with one, on eight blocks."""
    run = tolstat(machines, machines.study.settings.rtol)

    def blocks(workers: int) -> None:
        with ThreadPoolExecutor(workers) as executor:
            list(executor.map(lambda _: run(), range(8)))

    wall = time.perf_counter
    ratios = [
        seconds(lambda: blocks(1), wall) / seconds(lambda: blocks(2), wall)
        for _ in range(REPEATS)
    ]
    print(f"two workers: {median(ratios):.2f} times one")


def million(trials: int) -> None:
    """Run a study of many trials in a process of its own."""
    command = [sys.executable, "-m", "tests.studies.benchmarks.many", str(trials)]
    told = json.loads(
        subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout
    )
    times = 1e6 / trials
    print(
        f"{trials} trials, two workers: {told['seconds']:.1f} s, "
        f"{trials / told['seconds']:.0f}/s, {told['memory'] / 1e6:.0f} MB of memory, "
        f"{told['file'] / 1e6:.1f} MB of file; a million at that rate: "
        f"{told['seconds'] * times / 60:.0f} min, {told['file'] * times / 1e6:.0f} MB"
    )


def draw(lines: dict[str, list[Point]], path: Path) -> None:
    """Draw error over speed, a line an engine."""
    import matplotlib

    matplotlib.use("svg")
    from matplotlib import pyplot

    options = {"svg.hashsalt": "tolstat", "svg.fonttype": "none", "font.size": 9}
    with pyplot.rc_context(options):
        figure, axes = pyplot.subplots(figsize=(7.5, 4.6), layout="constrained")
        axes.axhspan(1.0, 1e9, color="0.93", zorder=0)
        axes.axhline(1.0, color="0.4", linewidth=0.8)
        for i, (name, points) in enumerate(lines.items()):
            fit = [point for point in points if np.isfinite(point.error)]
            x, y = [point.rate for point in fit], [point.error for point in fit]
            style = {"color": f"C{i}", "marker": "os^vD<>PX"[i % 9], "markersize": 4.5}
            axes.loglog(x, y, label=name, linewidth=2.5 if i == 0 else 1.2, **style)
        worst = max(point.error for each in lines.values() for point in each)
        axes.set_ylim(top=3 * worst)
        right = {"transform": axes.get_yaxis_transform(), "ha": "right"}
        axes.text(0.99, 1.15, "bound missed", **right)
        axes.set_xlabel("trajectories a second, one core")
        axes.set_ylabel("worst error / its bound")
        axes.grid(alpha=0.3)
        figure.legend(loc="outside right upper", frameon=False)
        figure.savefig(path, metadata={"Date": None})


def main() -> None:
    """Print the lines, draw the picture."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--picture", type=Path, help="an .svg to write")
    parser.add_argument("--million", type=int, default=20000, help="trials of that run")
    asked = parser.parse_args()
    study = load(STUDY)
    machines = Machines(study, drawn(study, TRIALS))
    cores = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {max(cores)})  # every engine, threads of its own included
    lines = table(machines, closer=2 if asked.picture else 0)
    plain()
    os.sched_setaffinity(0, cores)
    two_workers(machines)
    million(asked.million)
    if asked.picture:
        draw(lines, asked.picture)


if __name__ == "__main__":
    main()
