"""A planetary gear as a model: deviations of its parts in, responses out."""

from collections.abc import Mapping

import numpy as np

from tolstat.arrays import Array, Truths
from tolstat.machines.planetary import declarations, trials
from tolstat.machines.planetary.declarations import Settings
from tolstat.machines.planetary.design import design_of, shift_34
from tolstat.machines.planetary.views import OFFERS
from tolstat.model.contract import Model, Outcome, Spreads
from tolstat.model.description import Description, StudyNumber


class Planetary(Model):
    """Planetary gear with helical wheels and balanced axial forces."""

    name = "planetary"
    title = "planetary gear AA, II or AI with helical wheels, axial forces balanced"
    settings = Settings
    failures = declarations.FAILURES
    views = OFFERS
    assumptions = declarations.ASSUMPTIONS

    def describe(self, settings: Settings) -> Description:
        return declarations.description_of(settings, design_of(settings))

    def impossible(self, deviations: Array, settings: Settings) -> Mapping[str, Truths]:
        return trials.faults(deviations, design_of(settings), settings)

    def evaluate(self, deviations: Array, settings: Settings) -> Outcome:
        design, k = design_of(settings), settings.satellites
        (db2, db3), e, da, E = trials.parted(deviations, design, settings)
        F = design.F
        K, forces = trials.shared(e, F, settings.mesh_stiffness)
        responses = (
            trials.residual_axial_force(F / k, db2, db3, design),
            K,
            K * (F / k),
            np.count_nonzero(forces == 0, axis=1),
            trials.backlash(E, da, design),
        )
        return Outcome(np.stack(responses, axis=1))

    def numbers(
        self, settings: Settings, spreads: Spreads, *, independent: bool = True
    ) -> tuple[StudyNumber, ...]:
        design = design_of(settings)
        F = design.F / settings.satellites
        shift = shift_34(settings, design)
        words = "x4 + x3, or x4 - x3 of a ring, in modules"
        return (
            StudyNumber("ratio", "1", design.ratio, "wheel 1 to carrier", "1"),
            StudyNumber("D", "1", design.D, "dw2 / dw3", "1"),
            StudyNumber("helix_2", "rad", design.b2, "helix angle of wheel 2", "deg"),
            StudyNumber("helix_3", "rad", design.b3, "helix angle of wheel 3", "deg"),
            StudyNumber("profile_shift_34", "1", shift, words, "1"),
            StudyNumber("centre_distance", "m", design.a, "of both pairs of wheels"),
            StudyNumber("satellite_force", "N", F, "of each where all share equally"),
        )
