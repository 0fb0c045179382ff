"""The rolling block as a model: deviations of its parts in, responses out."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.machines.rolling_block.answers import modal_answers, moment_answers
from tolstat.machines.rolling_block.declarations import DESCRIPTION, RESPONSES
from tolstat.machines.rolling_block.drive import (
    CANNOT_EXIST,
    CONDITIONS,
    Drive,
    drives,
)
from tolstat.machines.rolling_block.history import chart_of
from tolstat.machines.rolling_block.loading import followed, load_steps, pulse
from tolstat.machines.rolling_block.modes import Modes, modes_of
from tolstat.machines.rolling_block.settings import Settings
from tolstat.machines.rolling_block.views.offers import OFFERS, shown
from tolstat.model.contract import History, Model, Outcome, closer, sample_times
from tolstat.model.description import Description
from tolstat.model.view import View
from tolstat.moving import Solution
from tolstat.status import Status

Array = NDArray[np.float64]


class RollingBlock(Model):
    """Torsional drive of a reducing-sizing block with a switched gearbox."""

    name = "rolling_block"
    title = "drive of a wire-rod rolling block: nine masses, gearbox of 128 ratios"
    settings = Settings
    failures = (CANNOT_EXIST,)
    conditions = CONDITIONS
    integrates = True
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
        """List contributors and responses; the settings do not change them.

        Parameters
        ----------
        settings : Settings
            Not used.

        Returns
        -------
        Description
            With units, symbols and where in the paper they stand.
        """
        return DESCRIPTION

    def impossible(
        self, deviations: Array, settings: Settings
    ) -> dict[str, NDArray[np.bool_]]:
        """Tell which drives cannot be built.

        Parameters
        ----------
        deviations : float64[trial, contributor]
            Relative, in the order of `describe`.
        settings : Settings
            The nominal drive.
        """
        _, exist = drives(deviations, settings)
        return {CANNOT_EXIST: ~exist}

    def evaluate(self, deviations: Array, settings: Settings) -> Outcome:
        """Answer one drive for each row of deviations.

        Parameters
        ----------
        deviations : float64[trial, contributor]
            Relative, in the order of `describe`.
        settings : Settings
            Combination, loads, speeds, tolerance.

        Returns
        -------
        Outcome
            The responses, NaN where a trial failed; status and steps.
        """
        drive, _ = drives(deviations, settings)
        modes = modes_of(drive.Q, drive.C)
        moved = both_moved(drive, modes, settings)
        return outcome_of(drive, modes, moved, settings)

    def history(self, deviations: Array, settings: Settings, step: float) -> History:
        """Load one drive and tell how its moments went.

        Parameters
        ----------
        deviations : float64[contributor]
            Relative, in the order of `describe`.
        settings : Settings
            Combination, loads, tolerance.
        step : float
            Time between two samples, s.

        Returns
        -------
        History
            From the first load to the horizon, and of the pulse likewise.
        """
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

    def view(self, name: str, deviations: Array, settings: Settings) -> View:
        """Show one of `views`.

        Parameters
        ----------
        name : str
            Of the view.
        deviations : float64[machine, contributor]
            Relative: of the drive that is shown, then of others, for bands.
        settings : Settings
            Of all of them.
        """
        return shown(name, deviations, settings)

    def tightened(self, settings: Settings) -> Settings:
        """Return settings whose rtol is a thousand times smaller.

        Parameters
        ----------
        settings : Settings
            Not changed.
        """
        tight: Settings = closer(settings)
        return tight


class Moved(NamedTuple):
    """What was integrated."""

    loaded: Solution  # the loads of the stands stepping
    pulsed: Solution  # a pulse on one stand


def both_moved(
    drive: Drive, modes: Modes, settings: Settings, samples: Array | None = None
) -> Moved:
    """Integrate drives under both loadings, with their twists at the sample times."""
    return Moved(
        followed(drive, modes, load_steps(settings), settings, samples),
        followed(drive, modes, pulse(settings), settings, samples),
    )


def outcome_of(
    drive: Drive,
    modes: Modes,
    moved: Moved,
    settings: Settings,
) -> Outcome:
    """Arrange the responses as `describe` lists them."""
    loaded, pulsed = (np.maximum(each.greatest, -each.least) for each in moved)
    found = {
        **modal_answers(drive, modes, settings),
        **moment_answers(loaded, pulsed, settings),
    }
    table = np.stack([found[response.name] for response in RESPONSES], axis=1)
    status = np.where(
        moved.loaded.status == Status.DONE, moved.pulsed.status, moved.loaded.status
    )
    return Outcome(
        np.where((status != Status.DONE)[:, None], np.nan, table),
        status,
        moved.loaded.steps + moved.pulsed.steps,
    )
