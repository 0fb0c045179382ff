"""Trials a second of an FMU: tolstat, FMPy's low level and its `simulate_fmu`.

And of a model of this package of the same machine.

python -m tests.studies.fmus.speed [TRIALS]; one process, each the best of three
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

import fmpy
import numpy as np

import tolstat
from tests.fmu.building import build
from tests.studies.fmus.two_masses import TwoMasses
from tolstat import catalogue
from tolstat.fmu.fmu_model import FmuModel
from tolstat.model.checked import check_model, described
from tolstat.model.settings import make

STOP, STEPS = 0.5, (1, 100)
NAMES = "peak", "position"


def best(function, trials):
    """Milliseconds a trial."""
    times = []
    for _ in range(3):
        began = time.perf_counter()
        function(trials)
        times.append((time.perf_counter() - began) / trials * 1e3)
    return min(times)


def loop(path, steps, gaps):
    """FMPy's low level, as its examples have it."""
    said = fmpy.read_model_description(path)
    references = {v.name: v.valueReference for v in said.modelVariables}
    fmu = fmpy.instantiate_fmu(fmpy.extract(path), said, "CoSimulation")

    def run(trials):
        for gap in gaps[:trials]:
            fmu.reset()
            fmu.setupExperiment(startTime=0.0, stopTime=STOP)
            fmu.setReal([references["gap"]], [gap])
            fmu.enterInitializationMode()
            fmu.exitInitializationMode()
            for i in range(steps):
                fmu.doStep(i * STOP / steps, STOP / steps)
            fmu.getReal([references[name] for name in NAMES])

    return run


def simulated(path, steps, gaps, kind="CoSimulation"):
    """`simulate_fmu` of an unpacked FMU."""
    said, folder = fmpy.read_model_description(path), fmpy.extract(path)

    def run(trials):
        for gap in gaps[:trials]:
            fmpy.simulate_fmu(
                folder, model_description=said, fmi_type=kind, stop_time=STOP,
                output_interval=STOP / steps, start_values={"gap": gap}, output=NAMES,
            )  # fmt: skip

    return run


def evaluated(model, settings, gaps):
    """With tolstat: in this process, or in a worker where the model is isolated."""
    made = make(model, settings)
    names = [part.name for part in described(model, made).contributors]
    rows = np.zeros((len(gaps), len(names)))
    rows[:, names.index("gap")] = gaps - 2e-4
    return lambda trials: model.evaluate(rows[:trials], made)


def main(trials):
    gaps = np.random.default_rng(1).normal(2e-4, 1e-5, trials)
    with tempfile.TemporaryDirectory() as folder:
        path = str(build("Backlash", 2, folder))
        isolated = catalogue.find(catalogue.load(path))
        here = FmuModel(Path(path))
        print("milliseconds a trial of", trials)
        for steps in STEPS:
            settings = {"max_step": STOP / steps}
            rows = {
                "FMPy's low level": loop(path, steps, gaps),
                "tolstat, in this process": evaluated(here, settings, gaps),
                "tolstat, in a worker process": evaluated(isolated, settings, gaps),
                "simulate_fmu": simulated(path, steps, gaps),
            }
            for name, run in rows.items():
                few = trials // 10 if name == "simulate_fmu" else trials
                print(f"co-simulation, {steps} steps: {name}: {best(run, few):.3f}")
        few = max(3, trials // 100)
        settings = {"model_exchange": True, "rtol": 1e-7, "max_step": STOP}
        print(
            f"model exchange: tolstat: {best(evaluated(here, settings, gaps), few):.1f}"
        )
        run = simulated(path, 500, gaps, "ModelExchange")
        print(f"model exchange: simulate_fmu, rtol 1e-5: {best(run, few):.1f}")
        ours = check_model(TwoMasses)
        for rtol in (1e-6, 1e-9):
            run = evaluated(ours, {"rtol": rtol}, gaps)
            print(f"a model of tolstat, rtol {rtol:g}: {best(run, trials):.3f}")
        answers = {
            "co-simulation": (isolated, {}),
            "model exchange, rtol 1e-9": (isolated, {**settings, "rtol": 1e-9}),
            "a model of tolstat, rtol 1e-6": (ours, {}),
            "a model of tolstat, rtol 1e-9": (ours, {"rtol": 1e-9}),
        }
        for name, (model, chosen) in answers.items():
            nominal = tolstat.evaluate(model, None, chosen).iloc[0]
            print(f"{name}: {nominal['peak']:.5f} N, {nominal['position']:.6e} m")
    print("FMPy", fmpy.__version__, "tolstat", tolstat.__version__)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 2000)
