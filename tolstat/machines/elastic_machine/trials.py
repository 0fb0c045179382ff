"""Trials: chains followed over the horizon, and their responses."""

from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array
from tolstat.machines.elastic_machine import parameters
from tolstat.machines.elastic_machine.declarations import (
    NO_REFERENCE,
    TOO_LONG,
    Settings,
)
from tolstat.machines.elastic_machine.exact_motion import motion_of
from tolstat.machines.elastic_machine.modes import natural_frequencies
from tolstat.model.contract import Outcome
from tolstat.moving import Accuracy, Solution, System, integrate, solve
from tolstat.status import Status

MOST_EXACT = 32  # masses


class Trials(NamedTuple):
    """A block of trials, and their motion."""

    chains: parameters.Chains
    programme: parameters.Programme
    events: parameters.Events
    solution: Solution  # its peaks: errors, residuals, torques; histories: errors first


def simulated(
    deviations: Array, settings: Settings, samples: Array | None = None
) -> Trials:
    """Follow trials over the horizon, with theta at the sample times.

    The motion is linear between two events, so it is solved exactly. Audits integrate
    it by Runge-Kutta; so are long chains, whose exact steps grow with the square of
    the number of masses.
    """
    chains = parameters.build(deviations, settings)
    programme = parameters.programme_of(chains, settings)
    events = parameters.events_of(chains, programme, settings)
    n = len(settings.inertia)
    if not settings.runge_kutta and n <= MOST_EXACT:
        solution = solve(motion_of(chains, programme, events, settings), samples)
        for extreme in (solution.greatest, solution.least):
            extreme[:, 2 * n :] *= chains.c
        return Trials(chains, programme, events, solution)
    # only an integration needs these equations compiled
    from tolstat.machines.elastic_machine.compiled import rates, watch

    machines = parameters.rows_of(chains, programme, events, settings)
    solution = integrate(
        System(rates, parameters.scale_of(settings), watch, n_extremes=3 * n),
        np.zeros((len(machines), 2 * n)),
        machines,
        events.marks,
        Accuracy(settings.rtol, settings.max_step),
        samples=samples,
    )
    return Trials(chains, programme, events, solution)


def outcome_of(trials: Trials, settings: Settings) -> Outcome:
    """Return the responses in the order of `description_of`, and the failures."""
    chains, solution = trials.chains, trials.solution
    peak = solution.peak  # error, residual, torque
    deflected = [s - 1 for s in parameters.deflected_at_start_up(settings)]
    at_start_up = parameters.deflection_at_start_up(chains, settings)
    reference = np.abs(at_start_up[:, deflected])
    with np.errstate(divide="ignore", invalid="ignore"):
        factor = peak[:, deflected] / reference
    frequency = natural_frequencies(chains.J, chains.c) / (2.0 * np.pi)
    responses = np.hstack([peak, factor, frequency])
    done = solution.status == Status.DONE
    no_reference = done & (reference == 0.0).any(axis=1)
    late = parameters.ends_late(chains, settings)
    failed = {NO_REFERENCE: no_reference, TOO_LONG: late}
    return Outcome(responses, solution.status, solution.steps, failed)
