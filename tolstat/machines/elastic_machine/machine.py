"""The elastic machine as a model: deviations of its parts in, responses out."""

from collections.abc import Mapping
from dataclasses import replace

from tolstat.arrays import Array, Truths
from tolstat.machines.elastic_machine import declarations, parameters, views
from tolstat.machines.elastic_machine.declarations import Settings
from tolstat.machines.elastic_machine.trials import outcome_of, simulated
from tolstat.model.contract import History, Model, Outcome, sample_times
from tolstat.model.description import Description


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

    def impossible(self, deviations: Array, settings: Settings) -> Mapping[str, Truths]:
        buildable = parameters.exist(parameters.build(deviations, settings))
        return {declarations.IMPOSSIBLE: ~buildable}

    def evaluate(self, deviations: Array, settings: Settings) -> Outcome:
        return outcome_of(simulated(deviations, settings), settings)

    def tightened(self, settings: Settings) -> Settings | None:
        """Return settings of the second method, which shares no step with the first."""
        tight: Settings | None = super().tightened(settings)
        return tight and replace(tight, runge_kutta=True)

    def history(self, deviations: Array, settings: Settings, step: float) -> History:
        time = sample_times(settings.horizon, step)
        trials = simulated(deviations[None, :], settings, time)
        chart = views.chart_of(time, trials, settings)
        return History(chart, outcome_of(trials, settings))
