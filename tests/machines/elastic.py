"""Elastic machines by other means: matrices, SciPy, and the numbers of the print."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.integrate import solve_ivp

NINTHS = np.array([0, 1, 2, 3, 6, 7, 8, 9]) / 9
KNOTS = {"constant": [], "polynomial": [], "trapezoidal": NINTHS[1:-1], "cycloid": []}


def matrices(inertia, stiffness, damping):
    """I, C, B, from the twist of each spring: D theta."""
    n = len(inertia)
    D = np.eye(n) - np.eye(n, k=-1)
    return np.diag(inertia), D.T @ np.diag(stiffness) @ D, D.T @ np.diag(damping) @ D


def jerk(law, s, omega0, t0):
    """phi0''' of a start-up law: the rate of its acceleration, which starts at zero."""
    if law == "trapezoidal":
        return 6.75 * omega0 / t0**2 * np.interp(s, NINTHS, [0, 1, 1, 0, 0, -1, -1, 0])
    if law == "cycloid":
        return omega0 / t0**2 * 2 * np.pi * np.sin(2 * np.pi * s)
    # twice the derivative of the stand's speed, 6 s^2 - 8 s^3 + 3 s^4
    return omega0 / t0**2 * (12 - 48 * s + 36 * s * s)


def solved(machine, times, step=None):
    """Theta at the times, by DOP853 from one switching time to the next.

    The acceleration is a state of its own, integrated from the jerk. Returns
    float64[time, mass], and with `step` the peaks |theta|, |theta - C^-1 M| from t0 on
    and |c twist| over the horizon, sampled so densely.
    """
    I, C, B = matrices(machine["inertia"], machine["stiffness"], machine["damping"])
    n, law = len(I), machine["start_up_law"]
    omega0, t0 = machine["final_speed"], machine["start_up_time"]
    loads = machine["load_torque"]
    inverse, ones = np.linalg.inv(I), np.ones(n)
    switching = {0.0, t0, *(t0 * k for k in KNOTS[law]), *(s["time"] for s in loads)}
    ends = sorted(switching | {machine["horizon"]})
    y, found = np.zeros(2 * n + 1), np.full((len(times), n), np.nan)
    peaks = np.zeros((3, n))
    for begin, end in pairwise(ends):
        M = np.zeros(n)
        for load in loads:
            if load["time"] <= begin:
                M[load["mass"] - 1] += load["torque"]
        starting = begin < t0
        y[-1] = omega0 / t0 if law == "constant" else y[-1]
        y[-1] = y[-1] if starting else 0.0

        def rates(t, y, M=M, starting=starting):
            theta, theta_, acceleration = y[:n], y[n : 2 * n], y[-1]
            force = M - I @ ones * acceleration - B @ theta_ - C @ theta
            change = 0.0
            if starting and law != "constant":
                change = jerk(law, t / t0, omega0, t0)
            return np.concatenate([theta_, inverse @ force, [change]])

        way = solve_ivp(
            rates, (begin, end), y, "DOP853", rtol=1e-13, atol=1e-15, dense_output=True
        )
        assert way.success
        inside = (np.asarray(times) >= begin) & (np.asarray(times) <= end)
        if inside.any():
            found[inside] = way.sol(np.asarray(times)[inside])[:n].T
        if step:
            theta = way.sol(np.linspace(begin, end, 2 + int((end - begin) / step)))[:n]
            left = theta - np.linalg.solve(C, M)[:, None]
            twist = np.diff(theta, axis=0, prepend=0.0)
            torque = np.array(machine["stiffness"])[:, None] * twist
            for row, values in enumerate(
                (theta, left if not starting else 0 * left, torque)
            ):
                peaks[row] = np.maximum(peaks[row], np.abs(values).max(axis=1))
        y = way.y[:, -1]
    return (found, peaks.ravel()) if step else found


def random_machine(rng, law="constant", n=None):
    """A chain with any damping, any steps of the load, at any times."""
    n = n or int(rng.integers(1, 6))
    t0 = rng.uniform(0.1, 1.0)
    times = [*rng.uniform(0, 1.5, 2), 0.0, t0, t0 / 3][: rng.integers(0, 6)]
    return {
        "inertia": rng.uniform(0.2, 2.0, n).tolist(),
        "stiffness": rng.uniform(200, 2000, n).tolist(),
        "damping": (rng.uniform(0, 1, n) ** 3 * 60).tolist(),
        "start_up_law": law,
        "final_speed": rng.uniform(-10, 20),
        "start_up_time": t0,
        "load_torque": [
            {"time": t, "mass": int(rng.integers(1, n + 1)), "torque": rng.normal(0, 5)}
            for t in times
        ],
        "horizon": 1.7,
    }


@dataclass
class Case:
    """A reference case of the specification; lines of time and theta of each mass."""

    inertia: list
    stiffness: list
    damping: list
    final_speed: float
    start_up_time: float
    load_torque: list
    printed: str

    @property
    def settings(self):
        """As a study would say it; the horizon is the last answer's time."""
        names = "inertia stiffness damping final_speed start_up_time load_torque"
        given = {name: getattr(self, name) for name in names.split()}
        return {**given, "horizon": self.times[-1]}

    @property
    def eps0(self):
        """The acceleration."""
        return self.final_speed / self.start_up_time

    @property
    def _table(self):
        return np.array([line.split() for line in self.printed.split("\n")], float)

    @property
    def times(self):
        """Ascending, float64[time]."""
        return self._table[:, 0]

    @property
    def answers(self):
        """Theta, float64[time, mass]."""
        return self._table[:, 1:]


ONE = [0.5], [2000.0]
LOAD = [{"time": 0.0, "mass": 1, "torque": -10.0}]
ONE_MASS = """\
.02   -1.162082307605e-02    -4.801481985895e-03
.05   -3.183934504806e-02    -1.100541928581e-02
.4    -1.396442532509e-02    -1.749756569394e-02
.8    -1.679510065862e-02    -1.749999970439e-02
.85    4.666717108112e-03    -9.638986128645e-03
1.5   -5.713878720373e-03    -5.000002011428e-03"""
TWO_MASSES = """\
.1                 -3.626588987501e-02 -4.813974064845e-02
.2221441469079183  -6.666666666667e-02 -1.333333333333e-01
.5                 -1.400910588194e-02 -1.545610348722e-02
1.2                -5.101123355020e-02 -7.932286021121e-02
1.3                 3.105568251278e-02  4.274198515981e-02
2                  -3.624101407194e-02 -9.503354255860e-02"""
FOUR_MASSES = """\
.05 -1.836256718499e-02 -2.408131929102e-02 -2.492833949631e-02 -2.499549076308e-02
.15 -5.526966454655e-02 -1.095137257488e-01 -1.603177973460e-01 -1.996305673620e-01
.3  -4.137014885534e-02 -7.854198228781e-02 -1.105898497885e-01 -1.345395061448e-01
.5  -3.588704185149e-02 -6.943223000367e-02 -1.029415839172e-01 -1.316733899430e-01
.6  -3.203622327911e-02 -6.456158172314e-02 -9.689341062188e-02 -1.230559723789e-01
1   -2.517453301628e-02 -5.581585686443e-02 -8.320327723583e-02 -1.016616800517e-01"""


def column(printed, number):
    """Keep the times and one further column."""
    rows = map(str.split, printed.split("\n"))
    return "\n".join(f"{row[0]} {row[number]}" for row in rows)


CASES = {
    "one mass": Case(*ONE, [4.0], 40.0, 0.8, LOAD, column(ONE_MASS, 1)),
    "overdamped": Case(*ONE, [100.0], 40.0, 0.8, LOAD, column(ONE_MASS, 2)),
    "two masses": Case(
        [4.0, 2.0], [1600.0, 800.0], [0.0, 0.0], 12.0, 1.2, [], TWO_MASSES
    ),
    "four masses": Case(
        [0.8, 0.6, 0.5, 0.3], [1200.0, 900.0, 700.0, 500.0], [1.2, 0.9, 0.7, 0.5],
        10.0, 0.5, [{"time": 0.1, "mass": 4, "torque": -4.0}], FOUR_MASSES,
    ),
}  # fmt: skip
