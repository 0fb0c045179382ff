"""The ring as a model: deviations of ring, tool and cut in, responses out."""

from collections.abc import Mapping

from tolstat.arrays import Array, Truths
from tolstat.machines.ring import declarations, views
from tolstat.machines.ring.declarations import Asked
from tolstat.machines.ring.parameters import exist
from tolstat.machines.ring.trials import outcome_of, simulated
from tolstat.model.contract import History, Model, Outcome, sample_times
from tolstat.model.description import Description


class Ring(Model):
    """A ring that turns on two supports while a tool module cuts it."""

    name = "ring"
    title = "turning of a ring on two supports: cutting forces, loss of cut, chatter"
    settings = declarations.Settings
    failures = declarations.FAILURES
    views = views.OFFERS
    assumptions = declarations.ASSUMPTIONS

    def describe(self, settings: Asked) -> Description:
        return declarations.description_of(settings)

    def impossible(self, deviations: Array, settings: Asked) -> Mapping[str, Truths]:
        return {declarations.IMPOSSIBLE: ~exist(deviations, settings)}

    def evaluate(self, deviations: Array, settings: Asked) -> Outcome:
        return outcome_of(simulated(deviations, settings), settings)

    def history(self, deviations: Array, settings: Asked, step: float) -> History:
        time = sample_times(settings.duration, step)
        trials = simulated(deviations[None, :], settings, time)
        chart = views.chart_of(time, trials, settings)
        return History(chart, outcome_of(trials, settings))
