"""One pass of everything that is compiled, uncompiled: plain NumPy, no Numba.

What this shows: the equations, the step and the march are NumPy that anybody can step
through with a debugger; the compiler adds speed and nothing else.
"""

from __future__ import annotations

import io
import os
import subprocess
import sys

import pandas as pd
import pytest

from tests.conftest import ROOT

OSCILLATOR = """
import tolstat
from tolstat import catalogue
machine = catalogue.load("runs/own/oscillator.py:Oscillator")
found = tolstat.evaluate(machine, {"mass": [0.0, 0.01, 0.02]}, {"horizon": 0.1})
print(found.to_csv(float_format="%.17g"))
"""
STAND = """
import tolstat
short = {"crank_speed": 60.0, "start_up": 0.02, "settle": 0, "cycles": 1}
found = tolstat.evaluate("stand", {"rod_difference": [0.0, 1e-4]}, short)
print(found.to_csv(float_format="%.17g"))
"""
ELASTIC = """
import tolstat
chain = {"inertia": [0.8, 0.6], "stiffness": [1200.0, 900.0], "damping": [1.2, 0.9],
         "load_torque": [{"time": 0.05, "mass": 2, "torque": -4.0}],
         "start_up_law": "trapezoidal", "start_up_time": 0.1, "horizon": 0.2,
         "rtol": 1e-6}
found = tolstat.evaluate("elastic_machine", {"start_up_time": [0.0, 0.03]}, chain)
print(found.to_csv(float_format="%.17g"))
"""
ROLLING = """
import tolstat
given = {"horizon": 0.02, "rtol": 1e-6, "delay": 2e-3}
found = tolstat.evaluate("rolling_block", {"stiffness_12": [0.0, 0.05]}, given)
print(found.to_csv(float_format="%.17g"))
"""
RING = """
import tolstat
soft = {"thickness": 0.05, "tool_stiffness": 1e5, "harmonics": 3, "duration": 0.09,
         "out_of_roundness_2": 1e-4, "tangential_depth_exponent": 0.9, "rtol": 1e-5}
found = tolstat.evaluate("ring", {"tool_stiffness": [0.0, 0.03]}, soft)
assert (found["out_of_cut_share"] > 0.0).all()
print(found.to_csv(float_format="%.17g"))
"""


def answers(code, **environment):
    # idle lanes hold zeros, and NumPy warns where registers say nothing
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", code],
        cwd=ROOT, capture_output=True, text=True, check=True,
        env={**os.environ, **environment},
    )  # fmt: skip
    return pd.read_csv(io.StringIO(done.stdout), index_col=0)


@pytest.mark.parametrize(
    "code",
    [OSCILLATOR, STAND, ELASTIC, ROLLING, RING],
    ids=["oscillator", "stand", "elastic", "rolling", "ring"],
)
def test_the_results_are_the_same_without_the_compiler(code):
    compiled = answers(code)
    plain = answers(code, NUMBA_DISABLE_JIT="1")
    assert (plain["status"] == "done").all()
    assert plain["steps"].to_numpy() == pytest.approx(compiled["steps"], rel=0.02)
    numbers = [n for n in compiled if n not in ("status", "steps", "energy_residual")]
    for name in numbers:
        scale = compiled[name].abs().max() or 1.0
        # contractions round otherwise, and a step may fall elsewhere
        assert plain[name].to_numpy() == pytest.approx(
            compiled[name].to_numpy(), abs=2e-3 * scale
        ), name
    if "peak" in compiled:
        assert plain["peak"].to_numpy() == pytest.approx(compiled["peak"], rel=1e-9)
