"""A planetary gear as a model: deviations of its parts in, responses out."""

from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array, Truths
from tolstat.machines.planetary import declarations
from tolstat.machines.planetary.declarations import NO_MESH, NO_TOOTH, Settings
from tolstat.machines.planetary.design import design_of, shift_34
from tolstat.machines.planetary.scheme import Design
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

    def impossible(self, deviations: Array, settings: Settings) -> dict[str, Truths]:
        return faults(deviations, design_of(settings), settings)

    def evaluate(self, deviations: Array, settings: Settings) -> Outcome:
        design, k = design_of(settings), settings.satellites
        (db2, db3), e, da, E = parted(deviations, design, settings)
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


DEPTH = 2.0  # modules, of a tooth


def residual_axial_force(F: float, db2: Array, db3: Array, design: Design) -> Array:
    """Return the residual axial force on a satellite, N.

    2T/dw2 tan(b2 + db2) - 2T/dw3 tan(b3 + db3), T the torque between its wheels, F =
    2T/dw2 in N, the deviations db2[trial], db3[trial] in rad. With tan(b + db) = tan b
    + sin db / (cos b cos(b + db)) what is in balance is exactly 0.
    """
    b2, b3, D = design.b2, design.b3, design.D
    at_2 = np.sin(db2) / (np.cos(b2) * np.cos(b2 + db2))
    at_3 = np.sin(db3) / (np.cos(b3) * np.cos(b3 + db3))
    return np.asarray(F * (design.unbalance + at_2 - D * at_3))


class Shares(NamedTuple):
    """How satellites share their load."""

    K: Array  # [trial], K_gamma, the largest force over the mean
    forces: Array  # [trial, satellite], N; 0 without contact


def shared(e: Array, F: float, c: float) -> Shares:
    """Return the shares of a load: sum over j of c max(0, X + e_j) = F.

    The satellite that stands out most touches first. The others follow in the order of
    their gaps to it, each when the load on the earlier ones closes its gap. So the
    satellites in contact are counted, and the forces are exact: nothing is iterated.
    All members are rigid and none floats. With all in contact, K_gamma = 1 + k c (max e
    - mean e) / F.

    Position errors e[trial, satellite], m, may have any size: above 0 takes more load,
    and with large ones one satellite carries all. F is the tangential force of all
    satellites together, N, and c the stiffness of one, N/m, both above 0.
    """
    k = e.shape[1]
    gaps = e.max(axis=1, keepdims=True) - e
    steps = np.sort(gaps, axis=1)
    sums = np.cumsum(steps, axis=1)  # in sequence, so the same in any block
    # the n-th touches if the load presses those before it further than its step
    touching = np.arange(1, k + 1) * steps - sums < F / c
    m = np.count_nonzero(touching, axis=1)
    K = k / m * (1 + c / F * np.take_along_axis(sums, m[:, None] - 1, axis=1)[:, 0])
    K = np.minimum(K, float(k))  # but for rounding it is
    return Shares(K, F / k * np.maximum(K[:, None] - k * c / F * gaps, 0.0))


def backlash(E: tuple[Array, ...], da: Array, design: Design) -> Array:
    """Return the play of wheel 1, carrier and wheel 4 fixed, rad.

    Of deviations, m, float64[trial]: E of the tooth thicknesses of wheels 1, 2, 3, 4;
    da of the centre distance, which opens an external mesh and closes an internal one.
    """
    E1, E2, E3, E4 = E
    s12, s34 = design.scheme
    jt12 = -(E1 + E2) + s12 * 2 * np.tan(design.alpha12) * da
    jt34 = -(E3 + E4) + s34 * 2 * np.tan(design.alpha34) * da
    return np.asarray((jt12 + design.D * jt34) / (design.dw1 / 2))


def felt_in_mesh(design: Design) -> float:
    """Return the movement in mesh 1-2 for 1 of a satellite's pin along its orbit.

    The satellite rolls on wheel 4: its point in mesh 1-2 is dw2/2 from the pin, the
    point that stands still dw3/2, on the other side (AI) or on the same (AA, II).
    """
    return abs(1 - design.scheme.s12 * design.scheme.s34 * design.D)


def parted(
    deviations: Array, design: Design, settings: Settings
) -> tuple[tuple[Array, Array], Array, Array, tuple[Array, ...]]:
    """Return deviations of helix angles, positions in mesh 1-2, distance, teeth."""
    k = settings.satellites
    e = deviations[:, 2 : 2 + k]
    if settings.position_at == "pin":
        e = felt_in_mesh(design) * e
    da, *E = deviations[:, 2 + k :].T
    return (deviations[:, 0], deviations[:, 1]), e, da, tuple(E)


def faults(deviations: Array, design: Design, settings: Settings) -> dict[str, Truths]:
    """Return which gears cannot be built, by the words of `FAILURES`."""
    db, e, da, E = parted(deviations, design, settings)
    steep = np.maximum(np.abs(design.b2 + db[0]), np.abs(design.b3 + db[1]))
    diameters = design.dw1, design.dw2, design.dw3, design.dw4
    wheels = zip(diameters, settings.teeth, strict=True)
    half_pitch = [np.pi * d / z / 2 for d, z in wheels]
    thin = [np.abs(deviation) / h for deviation, h in zip(E, half_pitch, strict=True)]
    depth = DEPTH * settings.module / max(1.0, settings.module_ratio)
    meshes = (steep < np.pi / 2) & (np.abs(da) < depth)
    meshes &= np.abs(e).max(axis=1) < half_pitch[0]
    return {NO_TOOTH: ~(np.maximum.reduce(thin) < 1), NO_MESH: ~meshes}
