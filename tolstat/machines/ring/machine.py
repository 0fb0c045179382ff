"""The ring as a model: deviations of ring, tool and cut in, responses out."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tolstat.machines.ring import views
from tolstat.machines.ring.declarations import description_of
from tolstat.machines.ring.harmonics import Array
from tolstat.machines.ring.history import chart_of
from tolstat.machines.ring.linear import static_depth
from tolstat.machines.ring.ring import build
from tolstat.machines.ring.settings import Asked, Settings
from tolstat.machines.ring.trials import (
    CONDITIONS,
    FAILURES,
    IMPOSSIBLE,
    outcome_of,
    simulated,
)
from tolstat.model.contract import History, Model, Outcome, closer
from tolstat.model.description import Description
from tolstat.model.view import View


class Ring(Model):
    """A ring that turns on two supports while a tool module cuts it."""

    name = "ring"
    title = "turning of a ring on two supports: cutting forces, loss of cut, chatter"
    settings = Settings
    integrates = True
    failures = FAILURES
    conditions = CONDITIONS
    views = views.OFFERS
    assumptions = (
        "Dormand-Prince 5(4), with a step of its own for each machine, that ends "
        "wherever the tool leaves or enters the cut; rtol bounds the error of each "
        "step on each state's scale, max_step its length.",
        "The middle line of the ring does not stretch; it bends in its plane, in "
        "harmonics 1 to N, and does not leave its two supports.",
        "The ring turns at constant speed; the tool engages suddenly, from rest.",
        "Cutting forces follow the depth of cut at once, by a power of it, and vanish "
        "out of the cut; what the previous turn left of the surface is not counted.",
        "Without hoop tension the ring does not rest beyond 2 sqrt nu: from 0.8 of it "
        "on static depth, static error and growth are not answered; a trial that "
        "deviates so far all the same ends as 'no static depth'.",
        "Gravity and the moment of the tangential force about the middle line are left "
        "out.",
    )

    def describe(self, settings: Asked) -> Description:
        """List contributors and responses: critical speeds only without hoop tension.

        Parameters
        ----------
        settings : Settings
            Whether the tension is counted, which lobes the blank may have.
        """
        return description_of(settings)

    def impossible(
        self, deviations: Array, settings: Asked
    ) -> dict[str, NDArray[np.bool_]]:
        """Tell which machines cannot be built.

        Parameters
        ----------
        deviations : float64[trial, contributor]
            SI, relative ones as fractions, in the order of `describe`.
        settings : Settings
            The nominal machine.
        """
        return {IMPOSSIBLE: ~build(deviations, settings).exists}

    def evaluate(self, deviations: Array, settings: Asked) -> Outcome:
        """Cut one ring for each row of deviations.

        Parameters
        ----------
        deviations : float64[trial, contributor]
            SI, relative ones as fractions, in the order of `describe`.
        settings : Settings
            The nominal machine, duration and accuracy.

        Returns
        -------
        Outcome
            The responses; which trials failed, and why; status and steps.
        """
        return outcome_of(simulated(deviations, settings), settings)

    def history(self, deviations: Array, settings: Asked, step: float) -> History:
        """Cut one ring and tell how depth, ring and tool moved.

        Parameters
        ----------
        deviations : float64[contributor]
            SI, in the order of `describe`.
        settings : Settings
            The nominal machine, duration and accuracy.
        step : float
            Time between two samples, s.
        """
        time = np.linspace(0.0, settings.duration, 1 + round(settings.duration / step))
        trials = simulated(deviations[None, :], settings, time)
        static = float(static_depth(trials.rings, settings.hoop)[0])
        chart = chart_of(time, trials.solution.history[0], trials.rings, static)
        return History(chart, outcome_of(trials, settings))

    def tightened(self, settings: Asked) -> Asked:
        """Return settings whose rtol is a thousand times smaller.

        Parameters
        ----------
        settings : Settings
            Not changed.
        """
        tight: Asked = closer(settings)
        return tight

    def view(self, name: str, deviations: Array, settings: Asked) -> View:
        """Show frequencies and growth over the speed, of the ring or with the tool.

        Parameters
        ----------
        name : str
            One of `views`.
        deviations : float64[machine, contributor]
            SI: the machine that is shown, then others for the bands.
        settings : Settings
            Of all of them.
        """
        if name == "spectrum":
            return views.spectrum(deviations, settings)
        return views.stability(deviations, settings)
