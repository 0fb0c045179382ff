"""The rolling block as a model: deviations of its parts in, responses out."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tolstat.machines.rolling_block.answers import modal_answers, moment_answers
from tolstat.machines.rolling_block.declarations import DESCRIPTION, RESPONSES
from tolstat.machines.rolling_block.drive import drives
from tolstat.machines.rolling_block.modes import modes_of
from tolstat.machines.rolling_block.settings import Settings
from tolstat.model.contract import Model, Outcome, closer
from tolstat.model.description import Description
from tolstat.status import Status

Array = NDArray[np.float64]

CANNOT_EXIST = "cannot exist"


class RollingBlock(Model):
    """Torsional drive of a reducing-sizing block with a switched gearbox."""

    name = "rolling_block"
    title = "drive of a wire-rod rolling block: nine masses, gearbox of 128 ratios"
    settings = Settings
    failures = (CANNOT_EXIST,)
    integrates = True
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
        "error of each step on the twists of the static load.",
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
        # only drives that are loaded need the compiler
        from tolstat.machines.rolling_block.loading import followed, load_steps, pulse

        drive, exist = drives(deviations, settings)
        modes = modes_of(drive.Q, drive.C)
        loaded = followed(drive, modes, load_steps(settings), settings)
        pulsed = followed(drive, modes, pulse(settings), settings)
        peaks = [np.maximum(each.greatest, -each.least) for each in (loaded, pulsed)]
        found = {
            **modal_answers(drive, modes, settings),
            **moment_answers(peaks[0], peaks[1], settings),
        }
        table = np.stack([found[response.name] for response in RESPONSES], axis=1)
        done = loaded.status == Status.DONE
        status = np.where(done, pulsed.status, loaded.status)
        return Outcome(
            np.where((status != Status.DONE)[:, None], np.nan, table),
            status,
            loaded.steps + pulsed.steps,
            {CANNOT_EXIST: ~exist},
        )

    def tightened(self, settings: Settings) -> Settings:
        """Return settings whose rtol is a thousand times smaller.

        Parameters
        ----------
        settings : Settings
            Not changed.
        """
        tight: Settings = closer(settings)
        return tight
