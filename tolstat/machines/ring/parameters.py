"""Rings, from the deviations of their parts, and the numbers of their equations."""

from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array, Truths
from tolstat.machines.ring import declarations, motion
from tolstat.machines.ring.declarations import Asked
from tolstat.machines.ring.harmonics import (
    Place,
    Supported,
    displacements,
    harmonics,
    nu_of,
    shared,
    supported,
)
from tolstat.machines.ring.motion import Ring, Tool, cutting_forces

POSITIVE = (
    "thickness", "width", "youngs_modulus", "density", "support_angle", "tool_mass",
    "tool_stiffness", "feed", "speed", "force_exponent",
)  # fmt: skip
NOT_NEGATIVE = ("ring_damping", "tool_damping", "cutting_force")
# of a harmonic's size over its deflection: with an rtol of 1e-6, forces of the rollers
# err by 1e-4 of their sigma; a margin of 1 doubles the steps
MARGIN = 10.0


class Rings(NamedTuple):
    """The trials of a block by the paper's letters, SI, float64[trial] by default."""

    nu: Array  # 1/s2, E J/(rho F r^4)
    pi_chi: Array  # kg, pi r rho F
    K_T: Array  # s
    alpha: Array  # rad, half the angle between the supports
    theta_R: Array  # rad, where the tool stands
    Omega: Array  # rad/s
    t_R0: Array  # m
    c_R: Array  # N, radial force at a depth of 1 mm
    x_R: Array  # its exponent
    c_T: Array  # N, tangential force at that depth
    x_T: Array
    m_c: Array  # kg
    c_c: Array  # N s/m
    K_C: Array  # N/m
    on: Supported  # [trial, harmonic]
    tool_place: Place  # [trial, harmonic], where the tool stands
    lobes: tuple[int, ...]  # harmonics k that the blank may be out of round
    e_cos: Array  # [trial, lobe], m: e_k cos(k theta_R + psi_k)
    e_sin: Array  # [trial, lobe], m: e_k sin(k theta_R + psi_k)


def values_of(deviations: Array, settings: Asked) -> dict[str, Array]:
    """Return nominal values with their deviations, by contributor."""
    values = {}
    names = [part.name for part in declarations.description_of(settings).contributors]
    for name, d in zip(names, deviations.T, strict=True):
        x = settings.nominal(name)
        values[name] = x * (1.0 + d) if name in declarations.RELATIVE else x + d
    if settings.radius is None:
        middle = settings.inner_radius_given + 0.5 * values["thickness"]
        values["radius"] = middle + deviations[:, 0]
    return values


def exist(deviations: Array, settings: Asked) -> Truths:
    """Return which trials can be built."""
    part = values_of(deviations, settings)
    positive = np.all([part[name] > 0.0 for name in POSITIVE], axis=0)
    not_negative = np.all([part[name] >= 0.0 for name in NOT_NEGATIVE], axis=0)
    hole = part["radius"] > 0.5 * part["thickness"]
    return np.asarray(positive & not_negative & hole & (part["support_angle"] < np.pi))


def build(deviations: Array, settings: Asked) -> Rings:
    """Return the rings of deviations[trial, contributor]."""
    part = values_of(deviations, settings)
    r, h, w = part["radius"], part["thickness"], part["width"]
    E, rho, Omega = part["youngs_modulus"], part["density"], part["speed"]
    alpha, theta_R = 0.5 * part["support_angle"], part["tool_angle"]
    V = 60.0 * Omega * (r + 0.5 * h)

    def at_1_mm(which: str) -> Array:
        """Return a force at a depth of 1 mm, (10): mm, mm a turn, m/min."""
        names = ("coefficient", "feed_exponent", "speed_exponent")
        C, y, n = (float(getattr(settings, f"{which}_{name}")) for name in names)
        return 10.0 * part["cutting_force"] * C * part["feed"] ** y * V**n

    on = supported(alpha, settings.harmonics)
    lobes = [
        (part[declarations.amplitude(k)], k * theta_R + part[declarations.phase(k)])
        for k in settings.out_of_roundness_harmonics
    ]
    return Rings(
        nu=nu_of(E, rho, w, h, r), pi_chi=np.pi * r * rho * (w * h),
        K_T=part["ring_damping"], alpha=alpha, theta_R=theta_R,
        Omega=Omega, t_R0=part["depth"],
        c_R=at_1_mm("radial"), x_R=part["force_exponent"],
        c_T=at_1_mm("tangential"),
        x_T=np.full_like(r, settings.tangential_depth_exponent),
        m_c=part["tool_mass"], c_c=part["tool_damping"], K_C=part["tool_stiffness"],
        on=on, tool_place=displacements(theta_R, on),
        lobes=settings.out_of_roundness_harmonics,
        e_cos=np.stack([e * np.cos(psi) for e, psi in lobes], axis=1),
        e_sin=np.stack([e * np.sin(psi) for e, psi in lobes], axis=1),
    )  # fmt: skip


def nominal(settings: Asked, n: int = 1) -> Rings:
    """Return n rings without deviations."""
    n_contributors = len(declarations.description_of(settings).contributors)
    return build(np.zeros((n, n_contributors)), settings)


def parts_of(rings: Rings, hoop: bool) -> tuple[Tool, Ring, list[Array]]:
    """Return tool, ring and out-of-roundness as the equations of motion take them.

    Rows are float64[trial], those of the ring float64[harmonic, trial]. Of a lobe of
    any trial its number and its two parts are there. With `hoop` the tension of the
    spinning ring is included: to second order its energy cancels -l_j^2 Omega^2 of M_j.
    """
    k, on = harmonics(rings.on.s.shape[1] + 1), rings.on
    nu, K_T, speed = rings.nu[:, None], rings.K_T[:, None], rings.Omega[:, None]
    d = nu * K_T * (k.n * k.n)
    spun = 0.0 if hoop else k.l * k.l * (speed * speed)
    tool = Tool(
        1.0 / rings.m_c, rings.c_c, rings.K_C, rings.t_R0,
        rings.c_R, rings.x_R, rings.c_T, rings.x_T, rings.Omega, 1.0 / rings.pi_chi,
        shared(on.s, k.C), shared(on.t, k.C),
        rings.pi_chi, np.cos(rings.theta_R), np.sin(rings.theta_R),
        1.0 / np.cos(rings.alpha), 1.0 / np.sin(rings.alpha),
    )  # fmt: skip
    ring = (
        np.broadcast_to(1.0 / k.C, d.shape), d, 2.0 * speed * k.l,
        nu * (k.n * k.n) - spun, k.j * speed * d, *on, *rings.tool_place,
    )  # fmt: skip
    lobes = [
        row
        for lobe, cos, sin in zip(
            rings.lobes, rings.e_cos.T, rings.e_sin.T, strict=True
        )
        # a round trial adds zeros, bit for bit: no answer depends on them
        if cos.any() or sin.any()
        for row in (np.full_like(speed[:, 0], lobe), cos, sin)
    ]
    return tool, Ring(*(rows.T for rows in ring)), lobes


def rows_of(rings: Rings, hoop: bool) -> Array:
    """Return float64[trial, parameter]: the fields of `parts_of`, one after another."""
    tool, ring, lobes = parts_of(rings, hoop)
    return np.vstack([*tool, *ring, *lobes]).T.copy()


def scale_of(settings: Asked) -> Array:
    """Return float64[state]: the size that each state's error is measured by.

    The tool's displacement by the nominal depth of cut; that of each harmonic by what
    the nominal cutting force bends it, which is far smaller: a roller's force is the
    harmonics' stiffness times these displacements. Speeds by that times the frequency
    of the nominal tool, or of the harmonic alone.
    """
    k, ring = harmonics(settings.harmonics), nominal(settings)
    omega_c = np.sqrt(settings.tool_stiffness / settings.tool_mass)
    square = ring.nu * (k.n * k.n)  # stiffness over pi chi
    force = np.hypot(*cutting_forces(ring.t_R0, ring))
    bent = np.where(force > 0.0, MARGIN * force / (ring.pi_chi * square), np.inf)
    bent = np.minimum(bent, settings.depth)
    speed = np.maximum(omega_c, np.sqrt(square / k.C)) * bent
    tool = [settings.depth, settings.depth * omega_c]
    return np.concatenate([bent, bent, speed, speed, tool])


def depth_of_cut(rings: Rings, states: Array, time: Array | float) -> Array:
    """Return t_R, m, of states[trial, state] at a time, s; one trial's at several."""
    tool, ring, lobes = parts_of(rings, hoop=False)
    return motion.depth_of_cut(np.asarray(time), states.T, lobes, tool, ring)
