"""Settings, contributors and responses of the ring."""

import dataclasses
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from tolstat.errors import ModelError
from tolstat.machines.ring.harmonics import nu_of
from tolstat.model.description import (
    POSITIVE,
    SHARE,
    Contributor,
    Description,
    Response,
)
from tolstat.model.settings import setting
from tolstat.units.grammar import Range, typed

PAPER_INNER_RADIUS = 3.0  # m, of the table, if a study gives no radius
NAMED_LOBES = 12  # harmonics of out-of-roundness with settings
RESTS = 0.8  # of the speed at which the lowest frequency is zero
# settings that a view may vary: nominal values above zero
VARIED = (
    "support_angle", "radius", "width", "thickness", "youngs_modulus", "density",
    "ring_damping", "tool_angle", "tool_stiffness", "tool_mass", "tool_damping",
    "depth", "feed", "cutting_force",
)  # fmt: skip


def amplitude(k: int) -> str:
    """Return the name of the k-th harmonic of out-of-roundness."""
    return f"out_of_roundness_{k}"


def phase(k: int) -> str:
    """Return the name of its phase."""
    return f"out_of_roundness_{k}_phase"


@dataclass(frozen=True)
class Asked:
    """Workpiece, tool and cut, method, and views, SI.

    Raises ModelError if two radii are given, the ring has no hole, the supports lie
    opposite each other, or a nominal out-of-roundness is of a harmonic that is not
    listed.
    """

    # fmt: off
    inner_radius: float | None = setting(None, f"inner radius; the middle line is half the actual thickness outside; paper: {PAPER_INNER_RADIUS:g} m if radius is not given", unit="m", above=0.0, presets={"paper": None})
    radius: float | None = setting(None, "radius r of the middle line, for any thickness, instead of inner_radius", unit="m", above=0.0, presets={"by inner_radius": None})
    thickness: float = setting(0.1, "thickness h of the ring", unit="m", above=0.0)
    width: float = setting(1.0, "width of the ring", unit="m", above=0.0)
    youngs_modulus: float = setting(2.1e11, "Young's modulus E; steel", unit="Pa", above=0.0)
    density: float = setting(7800.0, "density; steel", unit="kg/m^3", above=0.0)
    ring_damping: float = setting(1e-4, "internal friction K_T of the ring (Voigt)", unit="s", at_least=0.0)
    support_angle: float = setting(math.radians(80.0), "angle 2 alpha between the supports, below 180 deg", unit="rad", above=0.0)
    tool_angle: float = setting(math.pi, "angular position of the tool; 180 deg is midway between the supports", unit="rad")
    tool_stiffness: float = setting(5e5, "stiffness K_C of the tool module", unit="N/m", above=0.0)
    tool_mass: float = setting(100.0, "mass m_c of the tool module", unit="kg", above=0.0)
    tool_damping: float = setting(1e-4, "viscous damping of the tool module", unit="N s/m", at_least=0.0)
    speed: float = setting(0.5, "angular speed Omega of the ring", unit="rad/s", above=0.0)
    depth: float = setting(2e-3, "depth of cut t_R0 as set", unit="m", above=0.0)
    feed: float = setting(0.05, "feed S, mm per turn of the ring", above=0.0)
    cutting_force: float = setting(1.0, "scale of both cutting forces: material, wear", unit="1", at_least=0.0)
    force_exponent: float = setting(0.9, "exponent of the depth in the radial force", above=0.0)
    radial_coefficient: float = setting(243.0, "coefficient C of the radial force", at_least=0.0)
    radial_feed_exponent: float = setting(0.6, "exponent of the feed in the radial force")
    radial_speed_exponent: float = setting(-0.3, "exponent of the cutting speed in the radial force")
    tangential_coefficient: float = setting(300.0, "coefficient C of the tangential force", at_least=0.0)
    tangential_depth_exponent: float = setting(1.0, "exponent of the depth in the tangential force", above=0.0)
    tangential_feed_exponent: float = setting(0.75, "exponent of the feed in the tangential force")
    tangential_speed_exponent: float = setting(-0.15, "exponent of the cutting speed in the tangential force")
    out_of_roundness_harmonics: tuple[int, ...] = setting(tuple(range(1, NAMED_LOBES + 1)), f"harmonics k of the blank's out-of-roundness, each a contributor; those up to {NAMED_LOBES} have settings for nominal values", at_least=1, at_most=1000, count=(1, 100))
    harmonics: int = setting(6, "harmonics N of the ring's deflection", at_least=2, at_most=40)
    hoop: bool = setting(False, "whether the hoop tension of the spinning ring is included; the paper leaves it out")
    duration: float = setting(3.0, "simulated time, from the engagement on", unit="s", above=0.0)
    rtol: float = setting(1e-6, "integration tolerance, relative to each state's scale", above=0.0)
    max_step: float = setting(5e-3, "longest integration step", unit="s", above=0.0)
    speed_range: Range = setting(Range(0.0, 60.0), "speeds that views show", unit="rad/s", at_least=0.0)
    varied: str = setting("support_angle", "setting that the views vary beside the speed", choices=VARIED)
    varied_by: tuple[float, ...] = setting((0.5, 1.0, 1.5), "values of this setting, relative to the nominal one", above=0.0, count=(1, 8))
    # fmt: on

    def __post_init__(self) -> None:
        """Refuse what does not fit together."""
        if self.radius is not None and self.inner_radius is not None:
            raise ModelError("radius and inner_radius are both given; give one of them")
        if not self.middle_radius > 0.5 * self.thickness:
            raise ModelError(
                f"thickness = {self.thickness:g} m with radius = "
                f"{self.middle_radius:g} m: a ring has an inner radius above 0"
            )
        if not self.support_angle < math.pi:
            angle = typed("rad", self.support_angle)
            raise ModelError(f"support_angle = {angle}: it must be below 180 deg")
        lobes = self.out_of_roundness_harmonics
        if len(set(lobes)) < len(lobes):
            raise ModelError(
                f"out_of_roundness_harmonics = {list(lobes)}: list each harmonic once"
            )
        for k in range(1, NAMED_LOBES + 1):
            if k not in lobes and any(map(self.nominal, (amplitude(k), phase(k)))):
                raise ModelError(
                    f"{amplitude(k)} or its phase is given, but {k} is not in "
                    f"out_of_roundness_harmonics = {list(lobes)}"
                )

    def nominal(self, name: str) -> float:
        """Return the nominal value of a contributor; 0 of lobes without a setting."""
        if name == "radius":
            return self.middle_radius
        return float(getattr(self, name, 0.0))

    @property
    def rests(self) -> bool:
        """Whether the ring has a static depth, with a margin for deviations."""
        sizes = ("youngs_modulus", "density", "width", "thickness", "radius")
        E, rho, w, h, r = (np.array(self.nominal(name)) for name in sizes)
        nu = float(nu_of(E, rho, w, h, r))
        return self.hoop or self.speed < RESTS * 2.0 * math.sqrt(nu)

    @property
    def step(self) -> float:
        """Longest step, s: max_step, or what the fastest lobes of the blank permit."""
        fastest = max(self.out_of_roundness_harmonics)
        return min(self.max_step, 1.0 / (fastest * self.speed))

    @property
    def middle_radius(self) -> float:
        """Radius of the middle line of the nominal ring, m."""
        if self.radius is not None:
            return self.radius
        return self.inner_radius_given + 0.5 * self.thickness

    @property
    def inner_radius_given(self) -> float:
        """Inner radius, or the paper's, m."""
        return PAPER_INNER_RADIUS if self.inner_radius is None else self.inner_radius


def _lobes() -> Iterator[tuple[str, type, Any]]:
    """Yield amplitude and phase of each harmonic of out-of-roundness, declared."""
    for k in range(1, NAMED_LOBES + 1):
        words = "run-out" if k == 1 else f"out-of-roundness with {k} lobes"
        words = f"{words} of the blank, amplitude e_{k}"
        yield amplitude(k), float, setting(0.0, words, unit="m")
        yield phase(k), float, setting(0.0, f"its phase psi_{k}", unit="rad")


# written out, these would be twenty-four equal declarations
Settings = dataclasses.make_dataclass(
    "Settings",
    _lobes(),
    bases=(Asked,),
    namespace={"__module__": __name__, "__doc__": "Settings of the ring, SI."},
    frozen=True,
)


_PARTS = (
    Contributor("radius", "m", "r", "radius of the middle line", "(5)", part="ring"),
    Contributor("width", "m", "w", "width of the ring", "F in (5)", part="ring"),
    Contributor("thickness", "m", "h", "thickness of the ring", "F, J in (5)", part="ring"),
    Contributor("youngs_modulus", "1", "E", "Young's modulus of the ring", "mu in (5)", part="ring"),
    Contributor("density", "1", "rho", "density of the ring", "chi in (5)", part="ring"),
    Contributor("ring_damping", "1", "K_T", "internal friction of the ring", "(6), (7)", part="ring"),
    Contributor("support_angle", "rad", "2 alpha", "angle between the supports", "(3), (4)", shown="deg", part="set-up"),
    Contributor("tool_angle", "rad", "theta_R", "angular position of the tool", "(8), (9)", shown="deg", part="set-up"),
    Contributor("tool_stiffness", "1", "K_C", "stiffness of the tool module", "tool equation", part="tool"),
    Contributor("tool_mass", "1", "m_c", "mass of the tool module", "tool equation", part="tool"),
    Contributor("tool_damping", "1", "c_c", "damping of the tool module", "tool equation", part="tool"),
    Contributor("depth", "m", "t_R0", "depth of cut as set", "t_R in (10)", part="cut"),
    Contributor("feed", "1", "S", "feed", "(10)", part="cut"),
    Contributor("speed", "1", "Omega", "angular speed of the ring", "V in (10)", part="cut"),
    Contributor("cutting_force", "1", "P", "scale of both cutting forces", "(10)", part="cut"),
    Contributor("force_exponent", "1", "x_P", "exponent of the depth in the radial force, absolute", "(10)", shown="1", part="cut"),
)  # fmt: skip
RELATIVE = {each.name for each in _PARTS if each.unit == "1"} - {"force_exponent"}

_RESPONSES = (
    Response("depth_min", "m", "min t_R", "smallest depth of cut", "(10)"),
    Response("depth_max", "m", "max t_R", "greatest depth of cut", "(10)"),
    Response("depth_end", "m", "t_R(T)", "depth of cut at the end", "(10)"),
    Response("static_depth", "m", "t_s", "static depth of cut, with ring and tool at rest", "(10)"),
    Response("static_error", "m", "t_R0 - t_s", "machining error at rest", "(10)"),
    Response("peak_error", "m", "t_R0 - min t_R", "greatest machining error", "(10)"),
    Response("out_of_cut_share", "1", "tau", "share of the time out of the cut", "(10)", range=SHARE),
    Response("tool_travel", "m", "max |X_P|", "greatest displacement of the tool", "tool equation", range=POSITIVE),
    *(Response(f"roller_{i}_{which}", "N", f"{which} l_{i}", f"{words} force of the roller at pi {sign} alpha on the ring, outwards, without gravity", "(3), (4)") for i, sign in ((1, "-"), (2, "+")) for which, words in (("min", "smallest"), ("max", "greatest"))),
    Response("roller_lift", "1", "l/G", "greatest outward force of a roller over its dead load; below 1 both rollers hold", "(3), (4)", shown="%"),
    Response("radial_force_peak", "N", "max P_R", "peak radial cutting force", "(10)", range=POSITIVE),
    Response("tangential_force_peak", "N", "max P_T", "peak tangential cutting force", "(10)", range=POSITIVE),
    Response("zero_speed", "rad/s", "2 sqrt nu", "speed at which the lowest frequency is zero, without hoop tension", "M_2", shown="rad/s", range=POSITIVE),
    Response("flutter_speed", "rad/s", "Omega_f", "speed from which the frictionless ring flutters, without hoop tension", "M_j", shown="rad/s", range=POSITIVE),
    Response("growth_rate", "1/s", "tau_1", "growth rate of ring and tool about the static depth; chatter if clearly above 0, such as 0.01 1/s", "all equations", shown="1/s"),
)  # fmt: skip
OF_REST = ("static_depth", "static_error", "growth_rate")
# of the first-order model alone: with hoop tension there are none
CRITICAL = ("zero_speed", "flutter_speed")


def description_of(settings: Asked) -> Description:
    """Return contributors and responses: as many lobes as the settings name.

    Near the speed at which its lowest frequency is zero the ring has no static depth,
    and no growth about it.
    """
    lobes = [
        item
        for k in settings.out_of_roundness_harmonics
        for item in (
            Contributor(amplitude(k), "m", f"e_{k}", f"out-of-roundness of the blank, {k} lobes", "t_R", part="blank"),
            Contributor(phase(k), "rad", f"psi_{k}", f"phase of the {k} lobes", "t_R", shown="deg", part="blank"),
        )
    ]  # fmt: skip
    excluded = (CRITICAL if settings.hoop else ()) + (() if settings.rests else OF_REST)
    responses = tuple(item for item in _RESPONSES if item.name not in excluded)
    return Description((*_PARTS, *lobes), responses)


ASSUMPTIONS = (
    "Dormand-Prince 5(4) with separate steps for each trial, ended where the tool leaves or enters the cut.",
    "The middle line of the ring does not stretch; it bends in its plane, in harmonics 1 to N, and does not leave its two supports.",
    "The ring turns at constant speed; the tool engages suddenly, from rest.",
    "Cutting forces follow the depth of cut at once, by a power of it, and vanish out of the cut; the surface left by the previous turn is ignored.",
    "Without hoop tension the ring has no rest position above 2 sqrt nu. From 0.8 of it on, static depth, static error and growth are left out. A trial that deviates so far nevertheless fails as 'no static depth'.",
    "Gravity and the moment of the tangential force about the middle line are left out; roller_lift compares with the dead load.",
)  # fmt: skip
IMPOSSIBLE, NO_REST = "cannot exist", "no static depth"
FAILURES = {
    IMPOSSIBLE: "sizes, masses, stiffnesses, feed and speed are above 0, the thickness below the diameter, the support angle between 0 and 180 deg, damping and force not below 0",
    NO_REST: "ring and tool have a static depth of cut",
}
