"""One pass of everything that is compiled, uncompiled: plain NumPy, no Numba.

What this shows: the equations, the step and the march are NumPy that anybody can step
through with a debugger; the compiler adds speed and nothing else.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys

import numpy as np
import pytest

import tolstat
from tests.conftest import ROOT
from tolstat import catalogue

OSCILLATOR = "runs/own/oscillator.py:Oscillator"
CHAIN = {
    "inertia": [0.8, 0.6], "stiffness": [1200.0, 900.0], "damping": [1.2, 0.9],
    "load_torque": [{"time": 0.05, "mass": 2, "torque": -4.0}],
    "start_up_law": "trapezoidal", "start_up_time": 0.1, "horizon": 0.2, "rtol": 1e-6,
}  # fmt: skip
SOFT = {
    "thickness": 0.05, "tool_stiffness": 1e5, "harmonics": 3, "duration": 0.09,
    "out_of_roundness_2": 1e-4, "tangential_depth_exponent": 0.9, "rtol": 1e-5,
}  # fmt: skip
# by model: deviations, settings
TRIALS = {
    "oscillator": ({"mass": [0.0, 0.01, 0.02]}, {"horizon": 0.1}),
    "stand": (
        {"rod_difference": [0.0, 1e-4]},
        {"crank_speed": 60.0, "start_up": 0.02, "settle": 0, "cycles": 1},
    ),
    "elastic_machine": ({"start_up_time": [0.0, 0.03]}, CHAIN),
    "rolling_block": (
        {"stiffness_12": [0.0, 0.05]},
        {"horizon": 0.02, "rtol": 1e-6, "delay": 2e-3},
    ),
    "ring": ({"tool_stiffness": [0.0, 0.03]}, SOFT),
}


def answers(name):
    """Evaluate the trials of a model, in this process."""
    model = catalogue.load(OSCILLATOR) if name == "oscillator" else name
    return tolstat.evaluate(model, *TRIALS[name]).to_dict("list")


@pytest.fixture(scope="module")
def plain():
    """The answers of all models without the compiler, from one process."""
    code = (
        "import json\n"
        "from tests.machines.test_uncompiled import TRIALS, answers\n"
        "print(json.dumps({name: answers(name) for name in TRIALS}))"
    )
    # idle lanes hold zeros, and NumPy warns where registers say nothing
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", code],
        cwd=ROOT, capture_output=True, text=True, check=True,
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
    )  # fmt: skip
    return json.loads(done.stdout)


@pytest.mark.parametrize("name", TRIALS)
def test_the_results_are_the_same_without_the_compiler(name, plain):
    compiled, other = answers(name), plain[name]
    assert set(other["status"]) == {"done"}
    # registers of four doubles contract other sums than those of eight: 2.5 % there
    assert other["steps"] == pytest.approx(compiled["steps"], rel=0.04)
    if name == "ring":
        assert min(compiled["out_of_cut_share"]) > 0.0
        assert min(other["out_of_cut_share"]) > 0.0
    for number in set(compiled) - {"status", "steps", "energy_residual"}:
        scale = np.abs(compiled[number]).max() or 1.0
        # contractions round otherwise, and a step may fall elsewhere
        assert other[number] == pytest.approx(compiled[number], abs=2e-3 * scale), (
            number
        )
    if "peak" in compiled:
        assert other["peak"] == pytest.approx(compiled["peak"], rel=1e-9)
