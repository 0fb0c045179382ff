"""The elastic machine as a model: deviations of its parts in, responses out."""

from collections.abc import Mapping
from dataclasses import replace

from tolstat.arrays import Array, Truths
from tolstat.machines.elastic_machine import parameters, views
from tolstat.machines.elastic_machine.declarations import Settings, description_of
from tolstat.machines.elastic_machine.trials import (
    FAILURES,
    IMPOSSIBLE,
    outcome_of,
    simulated,
)
from tolstat.model.contract import History, Model, Outcome, sample_times
from tolstat.model.description import Description


class ElasticMachine(Model):
    """A chain of masses on springs, started by a programmed motion."""

    name = "elastic_machine"
    title = "elastic transmission: a chain of masses started by a programmed motion"
    settings = Settings
    failures = FAILURES
    views = views.OFFERS
    assumptions = (
        "The motion is linear between two events and solved exactly. Audits use a "
        "second method, Dormand-Prince 5(4); so do chains of more than 32 masses, and "
        "runge_kutta = true.",
        "The drive follows the programmed motion under any load; the final speed is "
        "reached exactly.",
        "Springs are linear and have no mass; damping is proportional to their rate of "
        "twist, and need not be classical; there is no backlash.",
        "The machine is at rest and without load before t = 0.",
        "Peak torques are elastic ones, without damping.",
    )

    def describe(self, settings: Settings) -> Description:
        return description_of(settings, parameters.deflected_at_start_up(settings))

    def impossible(self, deviations: Array, settings: Settings) -> Mapping[str, Truths]:
        return {IMPOSSIBLE: ~parameters.exist(parameters.build(deviations, settings))}

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
