"""Settings, contributors and responses of the stand."""

from dataclasses import dataclass

from tolstat.model.description import SHARE, Contributor, Description, Gear, Response
from tolstat.model.settings import setting

START, STEADY, WINDOW, END = range(4)  # marks of a trial
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


MESHES = ("13-10", "10-7", "11-8")  # gears of the meshes 0, 1, 2

_C = Contributor
_R = Response


def description_of(N: Settings) -> Description:
    """Return contributors, with sizes and wheels of the settings, and responses."""
    pinions = [(10, "pinion", N.r2, 1), (11, "pinion", N.r2, 2)]
    wheels = [(7, "wheel", N.r3, 1), (8, "wheel", N.r3, 2), *pinions]  # and mesh
    contributors = (
        *(_C(f"rod_length_{i}", "m", f"dl{i}", f"length of rod {i}", f"l_{i} in ({i + 3}), rod {i + 2}", N.l, part="rods") for i in (1, 2)),
        _C("rod_difference", "m", "dl", "half the difference of the rods: +dl, -dl", "(4), (5)", part="rods"),
        *(_C(f"rod_stiffness_{i}", "1", f"k{i}", f"axial stiffness and damping of rod {i}", f"(2), rod {i + 2}", part="rods") for i in (1, 2)),
        *(_C(f"rod_damping_{i}", "1", f"H{i}", f"damping of rod {i}, beside its stiffness", f"(2), rod {i + 2}", part="rods") for i in (1, 2)),
        *(_C(f"joint_clearance_{i}", "m", f"c{i}", f"play of both joints of rod {i}, diametral", f"d_{i} in (2), rod {i + 2}", part="rods") for i in (1, 2)),
        *(_C(f"crank_radius_{i}", "m", f"dr{i}", f"radius of crank {i}", f"r_{i} in ({i + 3}), wheel {i + 6}", N.r, part="cranks") for i in (1, 2)),
        _C("crank_difference", "m", "dr", "difference of the cranks: -dr/2, +dr/2", "(4), (5)", part="cranks"),
        *(_C(f"crank_angle_{i}", "rad", f"psi{i}", f"angular position of crank {i}", f"f_{i} in ({i + 3}), wheel {i + 6}", part="cranks") for i in (1, 2)),
        *(_C(f"tooth_position_{i}", "m", f"s{i}", f"constant tooth-position error of mesh {i + 9}-{i + 6}", f"mesh{i} in (2)", gear=Gear(2 * N.r3, "pitch"), part="gears") for i in (1, 2)),
        *(_C(f"runout_{i}", "m", f"E{i}", f"run-out of {wheel} {i}", f"mesh{mesh} in (2)", gear=Gear(2 * radius, "run-out"), part="gears") for i, wheel, radius, mesh in wheels),
        *(_C(f"runout_phase_{i}", "rad", f"th{i}", f"phase of the run-out of {wheel} {i}", f"mesh{mesh} in (2)", part="gears") for i, wheel, _, mesh in wheels),
        *(_C(f"mesh_stiffness_{i}", "1", f"k3{i}", f"stiffness of mesh {gears}", f"mesh{i} in (2)", part="gears") for i, gears in enumerate(MESHES)),
        _C("mesh_damping", "1", "Hk3", "damping of the meshes", "(2)", part="gears"),
        _C("shaft_9_stiffness", "1", "c3", "torsional stiffness of shaft 9", "(2)", part="shafts"),
        _C("shaft_12_stiffness", "1", "c2", "torsional stiffness of shaft 12", "(2)", part="shafts"),
        _C("shaft_9_damping", "1", "Hc3", "damping of shaft 9", "(2)", part="shafts"),
        _C("shaft_12_damping", "1", "Hc2", "damping of shaft 12", "(2)", part="shafts"),
        *(_C(f"wheel_inertia_{i}", "1", f"I{i}", f"moment of inertia of wheel {i + 6}", "(2)", part="gears") for i in (1, 2)),
        _C("carriage_mass", "1", "m", "mass of the carriage", "(2), (7), (9)"),
        _C("carriage_inertia", "1", "I_s", "moment of inertia of the carriage", "(2)"),
        *(_C(f"hinge_height_{i}", "m", f"h_{i}", f"height of the hinge of rod {i}", f"({i + 3}), (10), (11)", N.h, part="hinges") for i in (1, 2)),
        *(_C(f"hinge_arm_{i}", "m", f"a_{i}", f"hinge of rod {i} from the middle of the carriage", f"(2), ({i + 3}), (7)", N.dl_s / 2, part="hinges") for i in (1, 2)),
        _C("friction", "1", "mu", "sliding friction of the carriage", "(7), (8)"),
        _C("rolling_force", "1", "F0", "rolling force", "(3)"),
        _C("guide_clearance", "m", "dL", "side clearance between carriage and guides", "delta in (6)", N.dL),
        _C("guide_length", "m", "dh", "length of the carriage along the guides", "(6), (7), (8)", N.dh),
        _C("guide_stiffness", "1", "c_s", "stiffness of the guides against yawing", "(6)"),
        _C("guide_damping", "1", "H_s", "damping of the guides against yawing", "(6)"),
    )  # fmt: skip
    return Description(contributors, RESPONSES)


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
    _R("energy_residual", "1", "eps", "share of the drive energy unaccounted for", "balance of (2)", residual=True),
    *(_R(f"rod_force_{i}", "N", f"|k d_{i}|", f"peak force in rod {i}", f"({i + 3}), rod {i + 2}") for i in (1, 2)),
    *(_R(f"rod_tension_{i}", "N", f"+k d_{i}", f"peak tension in rod {i}", f"({i + 3}), rod {i + 2}") for i in (1, 2)),
    *(_R(f"rod_compression_{i}", "N", f"-k d_{i}", f"peak compression in rod {i}", f"({i + 3}), rod {i + 2}") for i in (1, 2)),
    _R("shaft_9_moment", "N m", "M9", "peak elastic moment of shaft 9", "(2)"),
    _R("shaft_12_moment", "N m", "M12", "peak elastic moment of shaft 12", "(2)"),
    *(_R(f"mesh_force_{i}", "N", f"F{i}", f"peak elastic force in mesh {gears}", "(2)") for i, gears in enumerate(MESHES)),
    _R("drive_moment", "N m", "M13", "peak moment on gear 13, dissipation included", "(2)"),
    _R("yaw", "rad", "alpha", "peak yaw of the carriage", "(2)"),
    *(_R(f"contacts_{i}", "1", f"n_{i}", f"times that the joints of rod {i} close", f"d_{i} in (2), rod {i + 2}", shown="count") for i in (1, 2)),
    *(_R(f"approach_{i}", "m/s", f"|d_{i}'|", f"greatest speed at which the joints of rod {i} close", f"d_{i} in (2), rod {i + 2}") for i in (1, 2)),
    *(_R(f"free_share_{i}", "1", f"tau_{i}", f"share of time in which rod {i} carries nothing, in its play", f"d_{i} in (2), rod {i + 2}") for i in (1, 2)),
    _R("jam_share", "1", "tau", "share of time in contact with the side guides", "(6)", range=SHARE),
)  # fmt: skip
_CONTRIBUTORS = description_of(Settings()).contributors
NAMES = tuple(contributor.name for contributor in _CONTRIBUTORS)
# relative deviations of a setting, by its letter
RELATIVE = {
    c.symbol: c.name
    for c in _CONTRIBUTORS
    if c.unit == "1" and c.symbol in Settings.__annotations__
}

ASSUMPTIONS = (
    "Dormand-Prince 5(4) with separate steps for each trial; the yaw rate is damped linearly within a step.",
    "Parts are rigid, or springs without mass; peak loads are elastic forces.",
    "Friction and the contact with the guides are smooth functions, as in the paper; the guides touch at one angle.",
    "The rolling force does not depend on the pass; nothing wears or heats up.",
)  # fmt: skip
NOTHING, NO_REACH, NO_FIT = "no part left", "rod too short", "does not fit"
OFF_CENTRE, NO_SHARE = "off its axis", "loses too much"
FAILURES = {
    NOTHING: "rods, cranks, hinge arms, guides, stiffnesses, inertias, masses and the gap between the feet are above 0; shaft 12, dampings, joint clearances, friction and rolling force not below",
    NO_REACH: "each rod is longer than its crank by more than the height of its hinge",
    NO_FIT: "the rods put the ends of the carriage less apart than their hinges are",
    OFF_CENTRE: "run-outs and tooth positions are smaller than the wheel",
    # parts deviate so much that the start-up releases more energy than the drive gives
    NO_SHARE: "the guides take from 0 to 100 % of the drive's energy",
}
