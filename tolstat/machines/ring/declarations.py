"""Contributors and responses of the ring: names, units, words."""

from __future__ import annotations

import math

from tolstat.machines.ring.settings import Asked, amplitude, phase
from tolstat.model.description import Contributor, Description, Response

POSITIVE = (0.0, math.inf)

_RING = (
    Contributor("radius", "m", "r", "radius of the middle line", "(5)", part="ring"),
    Contributor("width", "m", "w", "width of the ring", "F in (5)", part="ring"),
    Contributor("thickness", "m", "h", "thickness of the ring", "F, J in (5)", part="ring"),
    Contributor("youngs_modulus", "1", "E", "Young's modulus of the ring", "mu in (5)", part="ring"),
    Contributor("density", "1", "rho", "density of the ring", "chi in (5)", part="ring"),
    Contributor("ring_damping", "1", "K_T", "internal friction of the ring", "(6), (7)", part="ring"),
)  # fmt: skip
_SET_UP = (
    Contributor("support_angle", "rad", "2 alpha", "angle between the supports", "(3), (4)", shown="deg", part="set-up"),
    Contributor("tool_angle", "rad", "theta_R", "where the tool stands", "(8), (9)", shown="deg", part="set-up"),
)  # fmt: skip
_TOOL = (
    Contributor("tool_stiffness", "1", "K_C", "stiffness of the tool module", "tool equation", part="tool"),
    Contributor("tool_mass", "1", "m_c", "mass of the tool module", "tool equation", part="tool"),
    Contributor("tool_damping", "1", "c_c", "damping of the tool module", "tool equation", part="tool"),
)  # fmt: skip
_CUT = (
    Contributor("depth", "m", "t_R0", "depth of cut as set", "t_R in (10)", part="cut"),
    Contributor("feed", "1", "S", "feed", "(10)", part="cut"),
    Contributor("speed", "1", "Omega", "angular speed of the ring", "V in (10)", part="cut"),
    Contributor("cutting_force", "1", "P", "scale of both cutting forces", "(10)", part="cut"),
    Contributor("force_exponent", "1", "x_P", "exponent of the depth in the radial force, absolute", "(10)", shown="1", part="cut"),
)  # fmt: skip
RELATIVE = {
    each.name
    for each in (*_RING, *_SET_UP, *_TOOL, *_CUT)
    if each.unit == "1" and each.name != "force_exponent"
}

_CUTTING = (
    Response("depth_min", "m", "min t_R", "smallest depth of cut", "(10)"),
    Response("depth_max", "m", "max t_R", "greatest depth of cut", "(10)"),
    Response("depth_end", "m", "t_R(T)", "depth of cut at the end", "(10)"),
    Response("peak_error", "m", "t_R0 - min t_R", "greatest machining error", "(10)"),
    Response("out_of_cut_share", "1", "tau", "share of the time out of the cut", "(10)", range=(0.0, 1.0)),
    Response("tool_travel", "m", "max |X_P|", "greatest displacement of the tool", "tool equation", range=POSITIVE),
    Response("radial_force_peak", "N", "max P_R", "peak radial cutting force", "(10)", range=POSITIVE),
    Response("tangential_force_peak", "N", "max P_T", "peak tangential cutting force", "(10)", range=POSITIVE),
)  # fmt: skip
_RESTING = (
    Response("static_depth", "m", "t_s", "depth of cut at which ring and tool rest", "(10)"),
    Response("static_error", "m", "t_R0 - t_s", "machining error at rest", "(10)"),
)  # fmt: skip
# of the first-order model alone: with the tension counted there are none
_CRITICAL = (
    Response("zero_speed", "rad/s", "2 sqrt nu", "speed at which the lowest frequency is zero, without hoop tension", "M_2", shown="rad/s", range=POSITIVE),
    Response("flutter_speed", "rad/s", "Omega_f", "speed from which the frictionless ring flutters, without hoop tension", "M_j", shown="rad/s", range=POSITIVE),
)  # fmt: skip
_GROWTH = (
    Response("growth_rate", "1/s", "tau_1", "growth of ring and tool about the static depth; chatter where it is clearly above 0, as 0.01 1/s", "all equations", shown="1/s"),
)  # fmt: skip


def description_of(settings: Asked) -> Description:
    """List contributors and responses: as many lobes as the settings name.

    Near the speed at which its lowest frequency is zero the ring does not rest, so it has
    no static depth, and nothing grows from there.
    """
    lobes = [
        each
        for k in settings.out_of_roundness_harmonics
        for each in (
            Contributor(amplitude(k), "m", f"e_{k}", f"out-of-roundness of the blank, {k} lobes", "t_R", part="blank"),
            Contributor(phase(k), "rad", f"psi_{k}", f"phase of the {k} lobes", "t_R", shown="deg", part="blank"),
        )
    ]  # fmt: skip
    critical = () if settings.hoop else _CRITICAL
    resting, growth = (_RESTING, _GROWTH) if settings.rests else ((), ())
    return Description(
        (*_RING, *_SET_UP, *_TOOL, *_CUT, *lobes),
        (*_CUTTING[:3], *resting, *_CUTTING[3:], *critical, *growth),
    )
