"""The rolling block as a model: deviations of its parts in, responses out."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from tolstat.arrays import Array, Truths
from tolstat.machines.rolling_block.declarations import DESCRIPTION, Settings
from tolstat.machines.rolling_block.modes import modes_of
from tolstat.machines.rolling_block.parameters import CANNOT_EXIST, FAILURES, drives
from tolstat.machines.rolling_block.trials import both_moved, outcome_of
from tolstat.machines.rolling_block.views import OFFERS, chart_of
from tolstat.model.contract import History, Model, Outcome, sample_times
from tolstat.model.description import Description


class RollingBlock(Model):
    """Torsional drive of a reducing-sizing block with a switched gearbox."""

    name = "rolling_block"
    title = "drive of a wire-rod rolling block: nine masses, gearbox of 128 ratios"
    settings = Settings
    failures = FAILURES
    views = OFFERS
    assumptions = (
        "Nine masses on eight springs without mass, reduced to the motor shaft; upper "
        "and lower rolls of a stand are one mass, the rod between stands has no "
        "stiffness, as in the paper.",
        "Inertias and stiffnesses are identified from the paper's Table 1, which does "
        "not determine their common scale.",
        "Every elastic mode has the same damping ratio; the paper prints none.",
        "The gearbox is the least one that meets the printed ranges of ratios and the "
        "printed number of combinations; teeth and stage ratios are not printed.",
        "Amplification is the greatest elastic moment over the static one from the "
        "first load to the horizon, the loads stepping, a quarter on each stand.",
        "Dormand-Prince 5(4) with a step of its own for each drive; rtol bounds the "
        "error of each step on the twists of the static load; a link a million times "
        "stiffer, or damped so, takes minutes.",
    )

    def describe(self, settings: Settings) -> Description:
        return DESCRIPTION

    def impossible(self, deviations: Array, settings: Settings) -> Mapping[str, Truths]:
        return {CANNOT_EXIST: ~drives(deviations, settings)[1]}

    def evaluate(self, deviations: Array, settings: Settings) -> Outcome:
        drive, _ = drives(deviations, settings)
        modes = modes_of(drive.Q, drive.C)
        moved = both_moved(drive, modes, settings)
        return outcome_of(drive, modes, moved, settings)

    def history(self, deviations: Array, settings: Settings, step: float) -> History:
        drive, exist = drives(deviations[None, :], settings)
        modes = modes_of(drive.Q, drive.C)
        time = sample_times(settings.horizon, step)
        moved = both_moved(drive, modes, settings, time)
        C = np.where(exist, drive.C, np.nan)  # one that cannot exist has no moments
        chart = chart_of(
            time,
            settings.total_load * C * moved.loaded.history[0, :, : C.shape[1]],
            settings.pulse_moment * C * moved.pulsed.history[0, :, : C.shape[1]],
            settings,
        )
        return History(chart, outcome_of(drive, modes, moved, settings))
