"""The elastic machine: a chain started with jumps of acceleration, in closed form.

theta = twist against the programmed motion: I theta'' + B theta' + C theta =
-I 1 phi0'' + M(t), with phi0'' and M stepping at given times. The numbers are the
reference cases of the model's specification, good to 13 digits.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest

from tolstat.integrator.integrate import integrate
from tolstat.integrator.problem import Accuracy, System
from tolstat.integrator.signatures import rates_signature
from tolstat.lanes.compiled import compiled
from tolstat.lanes.rows import rows

PHASES = 4  # the times at which anything steps, at most


@compiled(rates_signature)
def chain(moment, y, p, out):
    """Rows of p: inertia, stiffness, damping of each mass, then for each phase its
    acceleration and the torque on each mass.
    """
    phase, Y, P, O = rows(moment)[1], rows(y), rows(p), rows(out)
    n = len(Y) // 2
    for s in range(n):
        O[s] = Y[n + s]
        torque = -P[n + s] * Y[s] - P[2 * n + s] * Y[n + s]
        if s > 0:
            torque = torque + P[n + s] * Y[s - 1] + P[2 * n + s] * Y[n + s - 1]
        if s + 1 < n:
            torque = torque + P[n + s + 1] * (Y[s + 1] - Y[s])
            torque = torque + P[2 * n + s + 1] * (Y[n + s + 1] - Y[n + s])
        acceleration = 0.0 * torque
        for k in range(PHASES):
            row = 3 * n + k * (n + 1)
            now = phase == float(k)
            acceleration = np.where(now, P[row], acceleration)
            torque = np.where(now, torque + P[row + 1 + s], torque)
        O[n + s] = torque / P[s] - acceleration


@dataclass
class Case:
    inertia: list
    stiffness: list
    damping: list
    accelerations: list  # (time, step of phi0'')
    torques: list  # (time, mass, step of torque)
    answers: dict = field(default_factory=dict)  # time -> theta of each mass


ONE = [(0, 50), (0.8, -50)], [(0, 1, -10)]
CASES = {
    "one mass": Case(
        [0.5], [2000], [4], *ONE,
        {
            0.02: [-1.162082307605e-02], 0.05: [-3.183934504806e-02],
            0.4: [-1.396442532509e-02], 0.8: [-1.679510065862e-02],
            0.85: [4.666717108112e-03], 1.5: [-5.713878720373e-03],
        },
    ),
    "overdamped": Case(
        [0.5], [2000], [100], *ONE,
        {
            0.02: [-4.801481985895e-03], 0.05: [-1.100541928581e-02],
            0.4: [-1.749756569394e-02], 0.8: [-1.749999970439e-02],
            0.85: [-9.638986128645e-03], 1.5: [-5.000002011428e-03],
        },
    ),
    "two masses": Case(
        [4, 2], [1600, 800], [0, 0], [(0, 10), (1.2, -10)], [],
        {
            0.1: [-3.626588987501e-02, -4.813974064845e-02],
            0.2221441469079183: [-6.666666666667e-02, -1.333333333333e-01],
            0.5: [-1.400910588194e-02, -1.545610348722e-02],
            1.2: [-5.101123355020e-02, -7.932286021121e-02],
            1.3: [3.105568251278e-02, 4.274198515981e-02],
            2: [-3.624101407194e-02, -9.503354255860e-02],
        },
    ),
    "four masses": Case(
        [0.8, 0.6, 0.5, 0.3], [1200, 900, 700, 500], [1.2, 0.9, 0.7, 0.5],
        [(0, 20), (0.5, -20)], [(0.1, 4, -4)],
        {
            0.05: [-1.836256718499e-02, -2.408131929102e-02, -2.492833949631e-02, -2.499549076308e-02],
            0.15: [-5.526966454655e-02, -1.095137257488e-01, -1.603177973460e-01, -1.996305673620e-01],
            0.3: [-4.137014885534e-02, -7.854198228781e-02, -1.105898497885e-01, -1.345395061448e-01],
            0.5: [-3.588704185149e-02, -6.943223000367e-02, -1.029415839172e-01, -1.316733899430e-01],
            0.6: [-3.203622327911e-02, -6.456158172314e-02, -9.689341062188e-02, -1.230559723789e-01],
            1: [-2.517453301628e-02, -5.581585686443e-02, -8.320327723583e-02, -1.016616800517e-01],
        },
    ),
}  # fmt: skip


def solve(case, rtol, answers_at):
    """Integrate a case with a mark at every step of the load and the given samples."""
    n = len(case.inertia)
    times = sorted(
        {t for t, _ in case.accelerations} | {t for t, _, _ in case.torques} | {0.0}
    )
    loads = []
    for k in range(PHASES):
        now = times[min(k, len(times) - 1)]
        loads.append(sum(step for t, step in case.accelerations if t <= now))
        for mass in range(1, n + 1):
            loads.append(
                sum(step for t, m, step in case.torques if t <= now and m == mass)
            )
    parameters = np.array(
        [*case.inertia, *case.stiffness, *case.damping, *loads], float
    )
    scale = np.array([0.1] * n + [3.0] * n)
    return integrate(
        System(chain, scale),
        np.zeros((1, 2 * n)),
        parameters[None],
        np.array([[*times, max(answers_at)]], float),
        Accuracy(rtol, 0.05),
        samples=np.array(sorted(answers_at), float),
    )


@pytest.mark.parametrize("name", CASES)
def test_known_answers(name):
    case = CASES[name]
    found = solve(case, 1e-10, case.answers)
    n = len(case.inertia)
    answers = np.array([case.answers[t] for t in sorted(case.answers)])
    peak = np.abs(answers).max()
    np.testing.assert_allclose(
        found.history[0, :, :n], answers, atol=1e-8 * peak, rtol=0
    )


def test_the_error_falls_with_the_tolerance_across_the_jumps():
    case = CASES["four masses"]
    answers = np.array([case.answers[t] for t in sorted(case.answers)])
    errors = [
        np.abs(solve(case, rtol, case.answers).history[0, :, :4] - answers).max()
        for rtol in (1e-4, 1e-6, 1e-8)
    ]
    assert errors[0] > 10 * errors[1] > 100 * errors[2]
