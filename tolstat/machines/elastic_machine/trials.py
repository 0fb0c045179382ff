"""Trials: chains integrated over the horizon, and their responses."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array
from tolstat.machines.elastic_machine import parameters
from tolstat.machines.elastic_machine.declarations import Settings
from tolstat.machines.elastic_machine.modes import natural_frequencies
from tolstat.model.contract import Outcome
from tolstat.moving import Accuracy, Solution, System, integrate
from tolstat.status import Status

IMPOSSIBLE = "cannot exist"
TOO_LONG = "still starting at the horizon"
NO_REFERENCE = "no static error"
FAILURES = {
    IMPOSSIBLE: "inertias, stiffnesses and the start-up time are above 0, damping not "
    "below",
    TOO_LONG: "the start-up ends before the horizon",
    NO_REFERENCE: "acceleration and load do not balance at the end of the start-up",
}


class Trials(NamedTuple):
    """A block of trials, and their motion."""

    chains: parameters.Chains
    machines: Array  # [trial, parameter], as the equations of motion read them
    marks: Array  # [trial, mark], s: start, events, horizon
    solution: Solution


def simulated(
    deviations: Array, settings: Settings, samples: Array | None = None
) -> Trials:
    """Integrate trials over the horizon, with their states at the sample times."""
    # only a simulation needs the compiler
    from tolstat.machines.elastic_machine.compiled import rates, watch

    chains = parameters.build(deviations, settings)
    marks, ended, begun = parameters.events_of(chains, settings)
    machines = parameters.rows_of(chains, ended, begun, settings)
    n = len(settings.inertia)
    solution = integrate(
        System(rates, parameters.scale_of(settings), watch, n_extremes=3 * n),
        np.zeros((len(machines), 2 * n)),
        machines,
        marks,
        Accuracy(settings.rtol, settings.max_step),
        samples=samples,
    )
    return Trials(chains, machines, marks, solution)


def outcome_of(trials: Trials, settings: Settings) -> Outcome:
    """Return the responses in the order of `description_of`, and the failures."""
    chains, solution = trials.chains, trials.solution
    peak = solution.peak  # error, residual, torque
    deflected = [s - 1 for s in parameters.deflected_at_start_up(settings)]
    reference = np.abs(
        parameters.deflection_at_start_up(chains, settings)[:, deflected]
    )
    with np.errstate(divide="ignore", invalid="ignore"):
        factor = peak[:, deflected] / reference
    frequency = natural_frequencies(chains.J, chains.c) / (2.0 * np.pi)
    responses = np.hstack([peak, factor, frequency])
    done = solution.status == Status.DONE
    no_reference = done & (reference == 0.0).any(axis=1)
    failed = {NO_REFERENCE: no_reference, TOO_LONG: chains.t0 >= settings.horizon}
    return Outcome(responses, solution.status, solution.steps, failed)
