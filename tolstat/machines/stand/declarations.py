"""Settings, contributors and responses of the stand."""

from __future__ import annotations

from dataclasses import dataclass

from tolstat.machines.stand.nominal import NOMINAL
from tolstat.model.description import SHARE, Contributor, Description, Gear, Response
from tolstat.model.settings import setting

# the guide contact with which the paper's Fig. 4 is met
FIG4_CONTACT_YAW = 5.8e-4


@dataclass(frozen=True)
class Settings:
    """Settings of the stand, SI; each has a sentence."""

    # fmt: off
    variant: str = setting("indeterminate", "the stand as built, or with a link that makes both rod forces equal", choices=("indeterminate", "equalized"))
    drive: str = setting("direct", "gear 13 drives pinion 10, or a differential splits its torque equally", choices=("direct", "balanced"))
    crank_speed: float = setting(7.5, "speed of the cranks", unit="rad/s", above=0.0)
    start_up: float = setting(1.0, "start-up time t1", unit="s", above=0.0)
    settle: int = setting(1, "turns between start-up and the window", at_least=0)
    cycles: int = setting(2, "turns in the window", at_least=1)
    contact_yaw: float | None = setting(None, "yaw at which the carriage touches its guides; geometry: dL/dh", unit="rad", above=0.0, presets={"geometry": None, "fig4": FIG4_CONTACT_YAW})
    rtol: float = setting(1e-3, "integration tolerance, relative to each state's scale", above=0.0)
    max_step: float = setting(1e-3, "longest integration step", unit="s", above=0.0)
    # fmt: on


_C = Contributor
_R = Response
_WHEEL, _PINION = 2 * NOMINAL.r3, 2 * NOMINAL.r2

CONTRIBUTORS = (
    _C("rod_length_1", "m", "dl1", "length of rod 1", "l_1 in (4), rod 3", NOMINAL.l, part="rods"),
    _C("rod_length_2", "m", "dl2", "length of rod 2", "l_2 in (5), rod 4", NOMINAL.l, part="rods"),
    _C("rod_difference", "m", "dl", "half the difference of the rods: +dl, -dl", "(4), (5)", part="rods"),
    _C("rod_stiffness_1", "1", "k1", "axial stiffness and damping of rod 1", "(2), rod 3", part="rods"),
    _C("rod_stiffness_2", "1", "k2", "axial stiffness and damping of rod 2", "(2), rod 4", part="rods"),
    _C("crank_radius_1", "m", "dr1", "radius of crank 1", "r_1 in (4), wheel 7", NOMINAL.r, part="cranks"),
    _C("crank_radius_2", "m", "dr2", "radius of crank 2", "r_2 in (5), wheel 8", NOMINAL.r, part="cranks"),
    _C("crank_difference", "m", "dr", "difference of the cranks: -dr/2, +dr/2", "(4), (5)", part="cranks"),
    _C("crank_angle_1", "rad", "psi1", "angular position of crank 1", "f_1 in (4), wheel 7", part="cranks"),
    _C("crank_angle_2", "rad", "psi2", "angular position of crank 2", "f_2 in (5), wheel 8", part="cranks"),
    _C("tooth_position_1", "m", "s1", "constant tooth-position error of mesh 10-7", "mesh1 in (2)", gear=Gear(_WHEEL, "pitch"), part="gears"),
    _C("tooth_position_2", "m", "s2", "constant tooth-position error of mesh 11-8", "mesh2 in (2)", gear=Gear(_WHEEL, "pitch"), part="gears"),
    _C("runout_7", "m", "E7", "run-out of wheel 7", "mesh1 in (2)", gear=Gear(_WHEEL, "run-out"), part="gears"),
    _C("runout_8", "m", "E8", "run-out of wheel 8", "mesh2 in (2)", gear=Gear(_WHEEL, "run-out"), part="gears"),
    _C("runout_10", "m", "E10", "run-out of pinion 10", "mesh1 in (2)", gear=Gear(_PINION, "run-out"), part="gears"),
    _C("runout_11", "m", "E11", "run-out of pinion 11", "mesh2 in (2)", gear=Gear(_PINION, "run-out"), part="gears"),
    _C("runout_phase_7", "rad", "th7", "phase of the run-out of wheel 7", "mesh1 in (2)", part="gears"),
    _C("runout_phase_8", "rad", "th8", "phase of the run-out of wheel 8", "mesh2 in (2)", part="gears"),
    _C("runout_phase_10", "rad", "th10", "phase of the run-out of pinion 10", "mesh1 in (2)", part="gears"),
    _C("runout_phase_11", "rad", "th11", "phase of the run-out of pinion 11", "mesh2 in (2)", part="gears"),
    _C("mesh_stiffness_0", "1", "k30", "stiffness of mesh 13-10", "mesh0 in (2)", part="gears"),
    _C("mesh_stiffness_1", "1", "k31", "stiffness of mesh 10-7", "mesh1 in (2)", part="gears"),
    _C("mesh_stiffness_2", "1", "k32", "stiffness of mesh 11-8", "mesh2 in (2)", part="gears"),
    _C("shaft_9_stiffness", "1", "c3", "torsional stiffness of shaft 9", "(2)", part="shafts"),
    _C("shaft_12_stiffness", "1", "c2", "torsional stiffness of shaft 12", "(2)", part="shafts"),
    _C("wheel_inertia_1", "1", "I1", "moment of inertia of wheel 7", "(2)", part="gears"),
    _C("wheel_inertia_2", "1", "I2", "moment of inertia of wheel 8", "(2)", part="gears"),
    _C("carriage_mass", "1", "m", "mass of the carriage", "(2), (7), (9)"),
    _C("friction", "1", "mu", "sliding friction of the carriage", "(7), (8)"),
    _C("rolling_force", "1", "F0", "rolling force", "(3)"),
    _C("guide_clearance", "m", "dL", "side clearance between carriage and guides", "delta in (6)"),
)  # fmt: skip
RESPONSES = (
    _R("extra_loss", "1", "Delta E", "share of the drive energy lost to guide friction", "Fig. 4", range=SHARE),
    _R("extra_loss_run", "1", "Delta E", "share of the drive energy lost to guide friction, from standstill to the end", "Fig. 4", range=SHARE),
    _R("drive_energy", "J", "W", "work of the drive on gear 13", "(1), (2)"),
    _R("slide_energy", "J", "W_fr1", "energy lost to friction under the weight", "(7)"),
    _R("guide_energy", "J", "W_fr2", "energy lost to friction at the side guides", "(7)"),
    _R("roll_energy", "J", "W_roll", "work of rolling", "(3)"),
    _R("spin_energy", "J", "W_spin", "energy lost to friction against yawing", "(9)"),
    _R("damping_energy", "J", "W_D", "energy lost in rods, meshes and shafts", "D in (2)"),
    _R("contact_energy", "J", "W_guide", "work of the guides against yawing", "(6)"),
    _R("energy_residual", "1", "eps", "share of the drive energy unaccounted for", "balance of (2)"),
    _R("rod_force_1", "N", "|k d_1|", "peak force in rod 1", "(4), rod 3"),
    _R("rod_force_2", "N", "|k d_2|", "peak force in rod 2", "(5), rod 4"),
    _R("rod_tension_1", "N", "+k d_1", "peak tension in rod 1", "(4), rod 3"),
    _R("rod_tension_2", "N", "+k d_2", "peak tension in rod 2", "(5), rod 4"),
    _R("rod_compression_1", "N", "-k d_1", "peak compression in rod 1", "(4), rod 3"),
    _R("rod_compression_2", "N", "-k d_2", "peak compression in rod 2", "(5), rod 4"),
    _R("shaft_9_moment", "N m", "M9", "peak elastic moment of shaft 9", "(2)"),
    _R("shaft_12_moment", "N m", "M12", "peak elastic moment of shaft 12", "(2)"),
    _R("mesh_force_0", "N", "F0", "peak elastic force in mesh 13-10", "(2)"),
    _R("mesh_force_1", "N", "F1", "peak elastic force in mesh 10-7", "(2)"),
    _R("mesh_force_2", "N", "F2", "peak elastic force in mesh 11-8", "(2)"),
    _R("drive_moment", "N m", "M13", "peak moment on gear 13, dissipation included", "(2)"),
    _R("yaw", "rad", "alpha", "peak yaw of the carriage", "(2)"),
    _R("jam_share", "1", "tau", "share of time in contact with the side guides", "(6)", range=SHARE),
)  # fmt: skip

DESCRIPTION = Description(CONTRIBUTORS, RESPONSES)
