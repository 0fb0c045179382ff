"""Settings, contributors and responses of the stand."""

from __future__ import annotations

from dataclasses import dataclass

from tolstat.model.description import SHARE, Contributor, Description, Gear, Response
from tolstat.model.settings import setting

# the guide contact with which the paper's Fig. 4 is met
FIG4_CONTACT_YAW = 5.8e-4


@dataclass(frozen=True)
class Settings:
    """Settings of the stand, SI; each has a sentence.

    Nominal values have the paper's letters; it prints them before equation (1), all but
    g. With them the model is any machine with two rods.
    """

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
    l: float = setting(2.45, "length of the rods", unit="m", above=0.0, group="geometry")
    r: float = setting(0.35, "radius of the cranks", unit="m", above=0.0, group="geometry")
    h: float = setting(0.28, "height of the rods' hinges above the wheels' axis", unit="m", at_least=0.0, group="geometry")
    dl_s: float = setting(0.864, "distance between the rods' hinges", unit="m", above=0.0, group="geometry")
    dh: float = setting(1.5, "length of the carriage along the guides", unit="m", above=0.0, group="geometry")
    dL: float = setting(0.0025, "side clearance between carriage and guides", unit="m", above=0.0, group="geometry")
    foot: float = setting(0.1, "width of the carriage's feet", unit="m", above=0.0, group="geometry")
    r1: float = setting(0.21, "radius of gear 13", unit="m", above=0.0, group="geometry")
    r2: float = setting(0.21, "radius of pinions 10, 11", unit="m", above=0.0, group="geometry")
    r3: float = setting(0.546, "pitch radius of wheels 7, 8", unit="m", above=0.0, group="geometry")
    x_roll: float = setting(2.2, "position where rolling begins", unit="m", group="geometry")
    m: float = setting(7800.0, "mass of the carriage", unit="kg", above=0.0, group="masses")
    I_s: float = setting(2770.0, "its moment of inertia about the vertical", unit="kg m^2", above=0.0, group="masses")
    I: float = setting(130.0, "moment of inertia of wheels 7, 8", unit="kg m^2", above=0.0, group="masses")
    g: float = setting(9.81, "gravity", unit="m/s^2", at_least=0.0, group="masses")
    k: float = setting(9.4e7, "stiffness of the rods", unit="N/m", above=0.0, group="stiffness")
    k3: float = setting(3.44e9, "stiffness of the tooth meshes", unit="N/m", above=0.0, group="stiffness")
    c3: float = setting(6.9e6, "stiffness of shaft 9", unit="N m/rad", above=0.0, group="stiffness")
    c2: float = setting(8.6e6, "stiffness of shaft 12", unit="N m/rad", at_least=0.0, group="stiffness")
    c_s: float = setting(1e8, "stiffness of the guides, against yawing", unit="N m/rad", above=0.0, group="stiffness")
    H: float = setting(188000.0, "damping of the rods; follows their stiffness", unit="N s/m", at_least=0.0, group="damping")
    Hk3: float = setting(68800.0, "damping of the tooth meshes", unit="N s/m", at_least=0.0, group="damping")
    Hc3: float = setting(13800.0, "damping of shaft 9", unit="N m s/rad", at_least=0.0, group="damping")
    Hc2: float = setting(17200.0, "damping of shaft 12", unit="N m s/rad", at_least=0.0, group="damping")
    H_s: float = setting(2e5, "damping of the guides, against yawing", unit="N m s/rad", at_least=0.0, group="damping")
    mu: float = setting(0.05, "sliding friction", unit="1", at_least=0.0, group="friction and loads")
    F0: float = setting(29400.0, "rolling force", unit="N", at_least=0.0, group="friction and loads")
    beta1: float = setting(1e3, "how sharply rolling begins", unit="1/m", above=0.0, group="friction and loads")
    beta2: float = setting(1e3, "sharpness of sliding friction and of rolling", unit="s/m", above=0.0, group="friction and loads")
    beta3: float = setting(1e6, "sharpness of the guides' clearance", unit="1/rad", above=0.0, group="friction and loads")
    beta4: float = setting(1e8, "sharpness of the guides' contact", unit="1/rad", above=0.0, group="friction and loads")
    beta5: float = setting(1e5, "sharpness of the friction against yawing", unit="s/rad", above=0.0, group="friction and loads")
    # fmt: on


_C = Contributor
_R = Response


def contributors_of(N: Settings) -> tuple[Contributor, ...]:
    """Return what deviates; sizes and wheels are those of the settings."""
    return (
        _C("rod_length_1", "m", "dl1", "length of rod 1", "l_1 in (4), rod 3", N.l, part="rods"),
        _C("rod_length_2", "m", "dl2", "length of rod 2", "l_2 in (5), rod 4", N.l, part="rods"),
        _C("rod_difference", "m", "dl", "half the difference of the rods: +dl, -dl", "(4), (5)", part="rods"),
        _C("rod_stiffness_1", "1", "k1", "axial stiffness and damping of rod 1", "(2), rod 3", part="rods"),
        _C("rod_stiffness_2", "1", "k2", "axial stiffness and damping of rod 2", "(2), rod 4", part="rods"),
        _C("rod_damping_1", "1", "H1", "damping of rod 1, beside its stiffness", "(2), rod 3", part="rods"),
        _C("rod_damping_2", "1", "H2", "damping of rod 2, beside its stiffness", "(2), rod 4", part="rods"),
        _C("joint_clearance_1", "m", "c1", "play of both joints of rod 1, diametral", "d_1 in (2), rod 3", part="rods"),
        _C("joint_clearance_2", "m", "c2", "play of both joints of rod 2, diametral", "d_2 in (2), rod 4", part="rods"),
        _C("crank_radius_1", "m", "dr1", "radius of crank 1", "r_1 in (4), wheel 7", N.r, part="cranks"),
        _C("crank_radius_2", "m", "dr2", "radius of crank 2", "r_2 in (5), wheel 8", N.r, part="cranks"),
        _C("crank_difference", "m", "dr", "difference of the cranks: -dr/2, +dr/2", "(4), (5)", part="cranks"),
        _C("crank_angle_1", "rad", "psi1", "angular position of crank 1", "f_1 in (4), wheel 7", part="cranks"),
        _C("crank_angle_2", "rad", "psi2", "angular position of crank 2", "f_2 in (5), wheel 8", part="cranks"),
        _C("tooth_position_1", "m", "s1", "constant tooth-position error of mesh 10-7", "mesh1 in (2)", gear=Gear(2 * N.r3, "pitch"), part="gears"),
        _C("tooth_position_2", "m", "s2", "constant tooth-position error of mesh 11-8", "mesh2 in (2)", gear=Gear(2 * N.r3, "pitch"), part="gears"),
        _C("runout_7", "m", "E7", "run-out of wheel 7", "mesh1 in (2)", gear=Gear(2 * N.r3, "run-out"), part="gears"),
        _C("runout_8", "m", "E8", "run-out of wheel 8", "mesh2 in (2)", gear=Gear(2 * N.r3, "run-out"), part="gears"),
        _C("runout_10", "m", "E10", "run-out of pinion 10", "mesh1 in (2)", gear=Gear(2 * N.r2, "run-out"), part="gears"),
        _C("runout_11", "m", "E11", "run-out of pinion 11", "mesh2 in (2)", gear=Gear(2 * N.r2, "run-out"), part="gears"),
        _C("runout_phase_7", "rad", "th7", "phase of the run-out of wheel 7", "mesh1 in (2)", part="gears"),
        _C("runout_phase_8", "rad", "th8", "phase of the run-out of wheel 8", "mesh2 in (2)", part="gears"),
        _C("runout_phase_10", "rad", "th10", "phase of the run-out of pinion 10", "mesh1 in (2)", part="gears"),
        _C("runout_phase_11", "rad", "th11", "phase of the run-out of pinion 11", "mesh2 in (2)", part="gears"),
        _C("mesh_stiffness_0", "1", "k30", "stiffness of mesh 13-10", "mesh0 in (2)", part="gears"),
        _C("mesh_stiffness_1", "1", "k31", "stiffness of mesh 10-7", "mesh1 in (2)", part="gears"),
        _C("mesh_stiffness_2", "1", "k32", "stiffness of mesh 11-8", "mesh2 in (2)", part="gears"),
        _C("mesh_damping", "1", "Hk3", "damping of the meshes", "(2)", part="gears"),
        _C("shaft_9_stiffness", "1", "c3", "torsional stiffness of shaft 9", "(2)", part="shafts"),
        _C("shaft_12_stiffness", "1", "c2", "torsional stiffness of shaft 12", "(2)", part="shafts"),
        _C("shaft_9_damping", "1", "Hc3", "damping of shaft 9", "(2)", part="shafts"),
        _C("shaft_12_damping", "1", "Hc2", "damping of shaft 12", "(2)", part="shafts"),
        _C("wheel_inertia_1", "1", "I1", "moment of inertia of wheel 7", "(2)", part="gears"),
        _C("wheel_inertia_2", "1", "I2", "moment of inertia of wheel 8", "(2)", part="gears"),
        _C("carriage_mass", "1", "m", "mass of the carriage", "(2), (7), (9)"),
        _C("carriage_inertia", "1", "I_s", "moment of inertia of the carriage", "(2)"),
        _C("hinge_height_1", "m", "h_1", "height of the hinge of rod 1", "(4), (10), (11)", N.h, part="hinges"),
        _C("hinge_height_2", "m", "h_2", "height of the hinge of rod 2", "(5), (10), (11)", N.h, part="hinges"),
        _C("hinge_arm_1", "m", "a_1", "hinge of rod 1 from the middle of the carriage", "(2), (4), (7)", N.dl_s / 2, part="hinges"),
        _C("hinge_arm_2", "m", "a_2", "hinge of rod 2 from the middle of the carriage", "(2), (5), (7)", N.dl_s / 2, part="hinges"),
        _C("friction", "1", "mu", "sliding friction of the carriage", "(7), (8)"),
        _C("rolling_force", "1", "F0", "rolling force", "(3)"),
        _C("guide_clearance", "m", "dL", "side clearance between carriage and guides", "delta in (6)"),
        _C("guide_length", "m", "dh", "length of the carriage along the guides", "(6), (7), (8)", N.dh),
        _C("guide_stiffness", "1", "c_s", "stiffness of the guides against yawing", "(6)"),
        _C("guide_damping", "1", "H_s", "damping of the guides against yawing", "(6)"),
    )  # fmt: skip


NAMES = tuple(each.name for each in contributors_of(Settings()))
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
    _R("contacts_1", "1", "n_1", "times that the joints of rod 1 close", "d_1 in (2), rod 3", shown="count"),
    _R("contacts_2", "1", "n_2", "times that the joints of rod 2 close", "d_2 in (2), rod 4", shown="count"),
    _R("approach_1", "m/s", "|d_1'|", "greatest speed at which the joints of rod 1 close", "d_1 in (2), rod 3"),
    _R("approach_2", "m/s", "|d_2'|", "greatest speed at which the joints of rod 2 close", "d_2 in (2), rod 4"),
    _R("free_share_1", "1", "tau_1", "share of time in which rod 1 carries nothing, in its play", "d_1 in (2), rod 3"),
    _R("free_share_2", "1", "tau_2", "share of time in which rod 2 carries nothing, in its play", "d_2 in (2), rod 4"),
    _R("jam_share", "1", "tau", "share of time in contact with the side guides", "(6)", range=SHARE),
)  # fmt: skip


def description_of(settings: Settings) -> Description:
    """Return contributors and responses of a stand with these settings."""
    return Description(contributors_of(settings), RESPONSES)
