"""Trials: chains integrated over the horizon, and what they answer."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.machines.elastic_machine.modes import natural_frequencies
from tolstat.machines.elastic_machine.parameters import (
    Chains,
    build,
    deflected_at_start_up,
    deflection_at_start_up,
    events_of,
    rows_of,
    scale_of,
)
from tolstat.machines.elastic_machine.settings import Settings
from tolstat.model.contract import Outcome
from tolstat.moving import Accuracy, Solution, System, integrate
from tolstat.status import Status

Array = NDArray[np.float64]

IMPOSSIBLE = "cannot exist"
TOO_LONG = "still starting at the horizon"
NO_REFERENCE = "no static error"
FAILURES = (IMPOSSIBLE, TOO_LONG, NO_REFERENCE)
CONDITIONS = {
    IMPOSSIBLE: "inertias, stiffnesses and the start-up time are above 0, damping not "
    "below"
}


class Trials(NamedTuple):
    """A block of machines, and how they moved.

    Attributes
    ----------
    chains : Chains
        The machines.
    machines : float64[trial, parameter]
        As the equations of motion read them.
    marks : float64[trial, mark]
        Start, events, horizon, s.
    solution : Solution
        As the integrator found it.
    """

    chains: Chains
    machines: Array
    marks: Array
    solution: Solution


def simulated(
    deviations: Array, settings: Settings, samples: Array | None = None
) -> Trials:
    """Integrate machines over the horizon, with their states at the sample times.

    Parameters
    ----------
    deviations : float64[trial, contributor]
        SI, in the order of `description_of`.
    settings : Settings
        The nominal machine, its start-up and load, horizon and accuracy.
    samples : float64[sample], optional
        Ascending times, s.
    """
    # only a machine that is simulated needs the compiler
    from tolstat.machines.elastic_machine.compiled import rates, watch

    chains = build(deviations, settings)
    events = events_of(chains, settings)
    machines = rows_of(chains, events, settings)
    n = len(settings.inertia)
    solution = integrate(
        System(rates, scale_of(settings), watch, n_extremes=3 * n),
        np.zeros((len(machines), 2 * n)),
        machines,
        events.marks,
        Accuracy(settings.rtol, settings.max_step),
        samples=samples,
    )
    return Trials(chains, machines, events.marks, solution)


def outcome_of(trials: Trials, settings: Settings) -> Outcome:
    """Arrange the responses as `description_of` lists them, and say which failed."""
    chains, solution = trials.chains, trials.solution
    peak = np.maximum(solution.greatest, -solution.least)  # error, residual, torque
    deflected = [s - 1 for s in deflected_at_start_up(settings)]
    reference = np.abs(deflection_at_start_up(chains, settings)[:, deflected])
    with np.errstate(divide="ignore", invalid="ignore"):
        factor = peak[:, deflected] / reference
    frequency = natural_frequencies(chains.J, chains.c) / (2.0 * np.pi)
    responses = np.hstack([peak, factor, frequency])
    failed = solution.status != Status.DONE
    return Outcome(
        np.where(failed[:, None], np.nan, responses),
        solution.status,
        solution.steps,
        {
            NO_REFERENCE: ~failed & (reference == 0.0).any(axis=1),
            TOO_LONG: ~chains.ends,
        },
    )
