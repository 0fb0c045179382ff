"""A planetary gear as a model: deviations of its parts in, responses out."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from tolstat.deviations.spread import Spread
from tolstat.machines.planetary.buildable import CONDITIONS, faults
from tolstat.machines.planetary.declarations import description_of
from tolstat.machines.planetary.design import Design, design_of
from tolstat.machines.planetary.settings import Settings
from tolstat.machines.planetary.sharing import shared
from tolstat.machines.planetary.tolerances import (
    backlash,
    felt_in_mesh,
    residual_axial_force,
)
from tolstat.machines.planetary.views import OFFERS, designs_listing, existence_chart
from tolstat.model.contract import Model, Outcome
from tolstat.model.description import Description, StudyNumber
from tolstat.model.view import View

Array = NDArray[np.float64]


class Planetary(Model):
    """Planetary gear with helical wheels and balanced axial forces."""

    name = "planetary"
    title = "planetary gear AA, II or AI with helical wheels, axial forces balanced"
    settings = Settings
    failures = tuple(CONDITIONS)
    conditions = CONDITIONS
    views = OFFERS
    assumptions = (
        "Satellites are equal springs that push and cannot pull; all other members are "
        "rigid, and none floats. The torque acts in one direction.",
        "Wheels have no profile shift; where a helix angle is given, wheels 3, 4 have "
        "the shift that makes them coaxial with 1 and 2.",
        "The residual axial force is that of a satellite with its equal share of load.",
        "The backlash is that of one satellite; satellites whose positions differ take "
        "as much from it. Teeth of nominal thickness have none.",
        "Undercut, interference and strength of the teeth are not looked at, nor is "
        "friction.",
    )

    def describe(self, settings: Settings) -> Description:
        """List contributors and responses: each satellite has a position error.

        Parameters
        ----------
        settings : Settings
            How many satellites there are, sizes that grades refer to.
        """
        return description_of(settings, design_of(settings))

    def impossible(
        self, deviations: Array, settings: Settings
    ) -> dict[str, NDArray[np.bool_]]:
        """Tell which gears cannot be built.

        Parameters
        ----------
        deviations : float64[trial, contributor]
            SI, in the order of `describe`.
        settings : Settings
            The gear.
        """
        design = design_of(settings)
        return faults(*_parted(deviations, design, settings), design, settings)

    def evaluate(self, deviations: Array, settings: Settings) -> Outcome:
        """Answer one gear for each row of deviations.

        Parameters
        ----------
        deviations : float64[trial, contributor]
            SI, in the order of `describe`.
        settings : Settings
            The gear and its load.

        Returns
        -------
        Outcome
            All responses.
        """
        design, k = design_of(settings), settings.satellites
        (db2, db3), e, da, E = _parted(deviations, design, settings)
        F = design.F
        K, forces = shared(e, F, settings.mesh_stiffness)
        responses = (
            residual_axial_force(F / k, db2, db3, design),
            K,
            K * (F / k),
            np.count_nonzero(forces == 0, axis=1),
            backlash(E, da, design),
        )
        return Outcome(np.stack(responses, axis=1))

    def numbers(
        self,
        settings: Settings,
        spreads: Mapping[str, Spread],
        *,
        independent: bool = True,
    ) -> tuple[StudyNumber, ...]:
        """Return what the gear is as designed.

        Parameters
        ----------
        settings : Settings
            The gear and its load.
        spreads : mapping of str to Spread
            Not used: tolerances do not change it.
        independent : bool
            Not used either.
        """
        design = design_of(settings)
        F = design.F / settings.satellites
        return (
            StudyNumber("ratio", "1", design.ratio, "wheel 1 to carrier", "1"),
            StudyNumber("D", "1", design.D, "dw2 / dw3", "1"),
            StudyNumber("helix_2", "rad", design.b2, "helix angle of wheel 2", "deg"),
            StudyNumber("helix_3", "rad", design.b3, "helix angle of wheel 3", "deg"),
            StudyNumber("centre_distance", "m", design.a, "of both pairs of wheels"),
            StudyNumber("satellite_force", "N", F, "of each where all share equally"),
        )

    def view(self, name: str, deviations: Array, settings: Settings) -> View:
        """Show gears of the kind, or where they exist.

        Parameters
        ----------
        name : str
            designs or existence.
        deviations : float64[machine, contributor]
            Not used: both are of gears as designed.
        settings : Settings
            Scheme, satellites, and what is wanted of the gears.
        """
        own = design_of(settings)
        if name == "designs":
            return designs_listing(settings, own)
        return existence_chart(settings, own)


def _parted(
    deviations: Array, design: Design, settings: Settings
) -> tuple[tuple[Array, Array], Array, Array, tuple[Array, ...]]:
    """Part deviations: helix angles, positions as mesh 1-2 feels them, distance, teeth.

    Parameters
    ----------
    deviations : float64[trial, contributor]
        SI, in the order of `describe`.
    design : Design
        The gear without deviations.
    settings : Settings
        How many satellites it has, and where their positions are told.
    """
    k = settings.satellites
    e = deviations[:, 2 : 2 + k]
    if settings.position_at == "pin":
        e = felt_in_mesh(design) * e
    da, *E = deviations[:, 2 + k :].T
    return (deviations[:, 0], deviations[:, 1]), e, da, tuple(E)
