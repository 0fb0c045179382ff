"""What isolation costs, and whether it holds.

python -m tests.studies.isolation.measure [KILLS]
"""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import psutil

import tolstat
from tests.isolation.trouble import TroubleSettings
from tolstat import catalogue
from tolstat.isolation import isolated_model
from tolstat.model.checked import simulate
from tolstat.status import Status

FILE = Path(tolstat.__file__).parents[1] / "tests" / "isolation" / "trouble.py"
STUDIES = "khpt75", "stack-up"
TRIALS = 256
LOOP = f"""
import tolstat
from tolstat import catalogue
catalogue.load({f"{FILE}:RowByRow"!r})
study = {{"model": "trouble_by_row", "seed": 1, "trials": 2_000_000,
          "deviations": {{"x": "+-1 m"}}, "settings": {{"how": "fine"}}}}
tolstat.run(study, output="kill.h5", force=True, workers=2)
"""


def best(call, times=20):
    """Return the shortest duration of a call, s."""
    durations = []
    for _ in range(times):
        began = time.perf_counter()
        call()
        durations.append(time.perf_counter() - began)
    return min(durations)


def overhead():
    """Print what a trial costs in blocks, ms, and a restart."""
    plain = catalogue.load(f"{FILE}:Trouble")
    for kind in ("Trouble", "RowByRow"):
        model = catalogue.isolated(catalogue.load(f"{FILE}:{kind}"))
        began = time.perf_counter()
        simulate(model, np.zeros((1, 1)), TroubleSettings())
        first = time.perf_counter() - began
        print(f"{kind}: first trial after {1e3 * first:.0f} ms")
        for rows in (1, 64, 1000):
            block = np.zeros((rows, 1))
            here, there = (
                best(lambda m=m, b=block: simulate(m, b, TroubleSettings()))
                for m in (plain, model)
            )
            more = 1e3 * (there - here) / rows
            print(f"  blocks of {rows}: {more:.4f} ms a trial more")
    (of_model, *_) = isolated_model._processes.values()

    def restart():
        with of_model.worker(fresh=True) as process:
            process.call(REQUEST, 60.0)
            process.grown = True  # ends it

    print(f"a fresh worker and its first reply: {1e3 * best(restart):.1f} ms")


REQUEST = isolated_model.packed(len, ())


def same_bits():
    """Print whether studies have the same bits in other processes."""
    for name in STUDIES:
        study = Path("runs") / f"{name}.toml"
        with tempfile.TemporaryDirectory() as folder:
            plain = tolstat.run(study, trials=TRIALS, output=f"{folder}/a.h5")
            with catalogue.isolating():
                other = tolstat.run(study, trials=TRIALS, output=f"{folder}/b.h5")
        names = [*plain.units, "status", "steps"]
        same = all(
            plain.columns[n].tobytes() == other.columns[n].tobytes()
            for n in names
            if n in plain.columns
        )
        same &= plain.source_digest == other.source_digest
        print(f"{name}, {TRIALS} trials: {'same bits' if same else 'DIFFERENT'}")


def kills(number):
    """Kill workers and parents at random moments; print what is left."""
    rows = np.random.default_rng(1).normal(0, 0.5, (2000, 1))
    model = catalogue.isolated(catalogue.load(f"{FILE}:RowByRow"))
    wrong = killed = 0
    while killed < number:
        with subprocess.Popen([sys.executable, "-c", KILLER, str(os.getpid())]) as one:
            answers = simulate(model, rows, TroubleSettings())
        wrong += int((answers.status != Status.DONE).sum())
        killed += one.returncode
    print(f"{killed} kills of workers and nurseries: {wrong} trials are blamed")
    left = 0
    for _ in range(number // 10):
        with tempfile.TemporaryDirectory() as folder:
            parent = subprocess.Popen([sys.executable, "-c", LOOP], cwd=folder)
            time.sleep(random.uniform(1.0, 5.0))
            family = psutil.Process(parent.pid).children(recursive=True)
            parent.kill()
            parent.wait()
            _, alive = psutil.wait_procs(family, timeout=10)
            left += len(alive)
    print(f"{number // 10} kills of tolstat: {left} processes are left after 10 s")


# kills one of the processes that a process has started; its exit code is their number
KILLER = """
import random, sys, time
import psutil
time.sleep(random.uniform(0, 0.05))
family = psutil.Process(int(sys.argv[1])).children(recursive=True)
family = [one for one in family if one.pid != psutil.Process().pid]
if family:
    random.choice(family).kill()
sys.exit(bool(family))
"""


def main():
    """Measure all of it."""
    signal.signal(signal.SIGPIPE, signal.SIG_IGN)
    overhead()
    same_bits()
    kills(int(sys.argv[1]) if len(sys.argv) > 1 else 300)


if __name__ == "__main__":
    main()
