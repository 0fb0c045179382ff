"""The elastic machine as a model: deviations of its parts in, responses out."""

import numpy as np

from tolstat.arrays import Array, Truths
from tolstat.machines.elastic_machine import declarations, parameters, views
from tolstat.machines.elastic_machine.declarations import Settings
from tolstat.machines.elastic_machine.modes import natural_frequencies
from tolstat.machines.elastic_machine.trials import Trials, simulated
from tolstat.model.contract import History, Model, Outcome, sample_times
from tolstat.model.description import Description
from tolstat.status import Status


class ElasticMachine(Model):
    """A chain of masses on springs, started by a programmed motion."""

    name = "elastic_machine"
    title = "elastic transmission: a chain of masses started by a programmed motion"
    settings = Settings
    failures = declarations.FAILURES
    views = views.OFFERS
    assumptions = declarations.ASSUMPTIONS

    def describe(self, settings: Settings) -> Description:
        deflected = parameters.deflected_at_start_up(settings)
        return declarations.description_of(settings, deflected)

    def impossible(self, deviations: Array, settings: Settings) -> dict[str, Truths]:
        buildable = parameters.exist(parameters.build(deviations, settings))
        return {declarations.IMPOSSIBLE: ~buildable}

    def evaluate(self, deviations: Array, settings: Settings) -> Outcome:
        return outcome_of(simulated(deviations, settings), settings)

    def history(self, deviations: Array, settings: Settings, step: float) -> History:
        time = sample_times(settings.horizon, step)
        trials = simulated(deviations[None, :], settings, time)
        chart = views.chart_of(time, trials, settings)
        return History(chart, outcome_of(trials, settings))


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
    failed = {declarations.NO_REFERENCE: no_reference, declarations.TOO_LONG: late}
    return Outcome(responses, solution.status, solution.steps, failed)
