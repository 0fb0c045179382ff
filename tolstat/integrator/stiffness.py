"""Stiffness: the fastest relaxation of the states, measured along a motion."""

from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array
from tolstat.integrator.integrate import Integration, integrate
from tolstat.integrator.problem import MOMENT_ROWS, PHASE, TIME, TIME_ENDED
from tolstat.status import Status

SAMPLES = 64  # times at which lambda is measured
CHANGE = 1e-6  # of its scale: of a state, for the slopes of the rates
LIMITING = 1.0  # steps of this over lambda, or longer: stability limits them, at 3.3


class Stiffness(NamedTuple):
    """How fast the fastest states relax, and in how many steps."""

    rate: float  # lambda, 1/s: minus the least real part of an eigenvalue, the median
    step: float  # s, the mean
    state: int  # that relaxes so fast, from 0

    @property
    def limits(self) -> bool:
        """Whether steps are about as long as stability permits."""
        return self.rate * self.step > LIMITING

    @property
    def words(self) -> str:
        """What it is, and what to do."""
        return (
            f"The equations are stiff: state {self.state + 1} relaxes at "
            f"{self.rate:.2g} 1/s and limits the steps to {self.step:.1g} s. If this "
            "state alone is so fast, name it in damped. Else the equations need an "
            "implicit method: another tool, or its FMU as the model."
        )


def stiffness_of(integration: Integration) -> Stiffness:
    """Return the stiffness of the trial with most steps; damped states are left out."""
    system, block, solution = integration
    trial = int(np.argmax(solution.steps))
    row = slice(trial, trial + 1)
    first, end = block.marks[trial, [0, -1]]
    if solution.status[trial] != Status.DONE:
        end = np.fmin(solution.ended[trial, TIME_ENDED], end)
    times = np.linspace(first, end, SAMPLES)
    history = integrate(
        system,
        block.start[row],
        block.parameters[row],
        block.marks[row],
        block.accuracy,
        samples=times,
    ).history[0]
    passed = np.isfinite(history).all(axis=1)
    step = float(end - first) / max(int(solution.steps[trial]), 1)
    times, history = times[passed], history[passed]
    if not len(times) or not step > 0.0:
        return Stiffness(0.0, 0.0, 0)
    phases = np.searchsorted(block.marks[trial], times, side="right") - 1
    phases = phases.clip(0, block.marks.shape[1] - 2)
    free = [i for i in range(history.shape[1]) if i not in system.damped]
    jacobians = _jacobians(integration, trial, times, phases, history)
    jacobians = jacobians[np.isfinite(jacobians).all(axis=(1, 2))][:, free][:, :, free]
    if not jacobians.size:
        return Stiffness(0.0, step, 0)
    # in units of the scales, so that the largest part of an eigenvector is its state
    values, vectors = np.linalg.eig(jacobians)
    fastest = np.argmin(values.real, axis=1)
    rates = -np.take_along_axis(values.real, fastest[:, None], 1)[:, 0]
    middle = int(np.argsort(rates)[len(rates) // 2])
    state = int(np.argmax(np.abs(vectors[middle, :, fastest[middle]])))
    return Stiffness(max(float(rates[middle]), 0.0), step, free[state])


def _jacobians(
    integration: Integration, trial: int, times: Array, phases: Array, states: Array
) -> Array:
    """Return slopes of rates over states, float64[time, state, state], over scales."""
    from tolstat.lanes.vector import WIDTH  # loads the compiler

    system, block, _ = integration
    scale, n = np.array(system.scale, float), states.shape[1]
    rows = n + system.n_quadratures + system.n_watched
    rows += len(system.damped) * (1 + len(system.sloped))
    out = np.zeros((rows, WIDTH))
    jacobians = np.empty((len(times), n, n))
    moment = np.ones((MOMENT_ROWS + len(system.crossings), WIDTH))
    for number, (time, phase, y) in enumerate(zip(times, phases, states, strict=True)):
        of_phase = min(int(phase), block.parameters.shape[1] - 1)
        p = np.repeat(block.parameters[trial, of_phase][:, None], WIDTH, axis=1)
        moment[TIME], moment[PHASE] = time, phase
        _choose_sides(integration, moment, y, p, out)

        def rates(i: int, change: float, y: Array = y, p: Array = p) -> Array:
            moved = np.repeat(y[:, None], WIDTH, axis=1)
            moved[i] += change
            system.rates(moment, moved, p, out)
            return out[:n, 0].copy()

        with np.errstate(all="ignore"):
            for i in range(n):
                d = CHANGE * scale[i]
                slope = (rates(i, d) - rates(i, -d)) / (2.0 * d)
                jacobians[number, :, i] = slope * scale[i] / scale
    return jacobians


def _choose_sides(
    integration: Integration, moment: Array, y: Array, p: Array, out: Array
) -> None:
    """Store the sides of all crossings in a moment, by their quantities."""
    system = integration.system
    first = len(y) + system.n_quadratures
    for _ in range(2 if system.crossings else 0):  # one may depend on another
        system.rates(moment, np.repeat(y[:, None], out.shape[1], axis=1), p, out)
        for i, number in enumerate(system.crossings):
            moment[MOMENT_ROWS + i] = np.sign(out[first + number])
