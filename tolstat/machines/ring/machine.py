"""The ring as a model: deviations of ring, tool and cut in, responses out."""

from collections.abc import Mapping

from tolstat.arrays import Array, Truths
from tolstat.machines.ring import views
from tolstat.machines.ring.declarations import Asked, Settings, description_of
from tolstat.machines.ring.parameters import exist
from tolstat.machines.ring.trials import FAILURES, IMPOSSIBLE, outcome_of, simulated
from tolstat.model.contract import History, Model, Outcome, sample_times
from tolstat.model.description import Description


class Ring(Model):
    """A ring that turns on two supports while a tool module cuts it."""

    name = "ring"
    title = "turning of a ring on two supports: cutting forces, loss of cut, chatter"
    settings = Settings
    failures = FAILURES
    views = views.OFFERS
    assumptions = (
        "Dormand-Prince 5(4) with separate steps for each trial, ended where the tool "
        "leaves or enters the cut.",
        "The middle line of the ring does not stretch; it bends in its plane, in "
        "harmonics 1 to N, and does not leave its two supports.",
        "The ring turns at constant speed; the tool engages suddenly, from rest.",
        "Cutting forces follow the depth of cut at once, by a power of it, and vanish "
        "out of the cut; the surface left by the previous turn is ignored.",
        "Without hoop tension the ring has no rest position above 2 sqrt nu. From 0.8 "
        "of it on, static depth, static error and growth are left out. A trial that "
        "deviates so far nevertheless fails as 'no static depth'.",
        "Gravity and the moment of the tangential force about the middle line are left "
        "out; roller_lift compares with the dead load.",
    )

    def describe(self, settings: Asked) -> Description:
        return description_of(settings)

    def impossible(self, deviations: Array, settings: Asked) -> Mapping[str, Truths]:
        return {IMPOSSIBLE: ~exist(deviations, settings)}

    def evaluate(self, deviations: Array, settings: Asked) -> Outcome:
        return outcome_of(simulated(deviations, settings), settings)

    def history(self, deviations: Array, settings: Asked, step: float) -> History:
        time = sample_times(settings.duration, step)
        trials = simulated(deviations[None, :], settings, time)
        chart = views.chart_of(time, trials, settings)
        return History(chart, outcome_of(trials, settings))
