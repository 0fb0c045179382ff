"""Rings, from the deviations of their parts."""

from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array, Truths
from tolstat.machines.ring.declarations import (
    RELATIVE,
    Asked,
    amplitude,
    description_of,
    phase,
)
from tolstat.machines.ring.harmonics import (
    Place,
    Supported,
    displacements,
    nu_of,
    supported,
)

POSITIVE = (
    "thickness", "width", "youngs_modulus", "density", "support_angle", "tool_mass",
    "tool_stiffness", "feed", "speed", "force_exponent",
)  # fmt: skip
NOT_NEGATIVE = ("ring_damping", "tool_damping", "cutting_force")


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
    names = [part.name for part in description_of(settings).contributors]
    for name, d in zip(names, deviations.T, strict=True):
        nominal = settings.nominal(name)
        values[name] = nominal * (1.0 + d) if name in RELATIVE else nominal + d
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
        (part[amplitude(k)], k * theta_R + part[phase(k)])
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


def out_of_roundness(rings: Rings, t: Array | float) -> Array:
    """Return the out-of-roundness of the blank at the tool, m, at a time, s.

    float64[trial]; of a single trial at several times, float64[time].
    """
    depth = 0.0 * rings.Omega
    for i, k in enumerate(rings.lobes):
        turn = k * rings.Omega * t
        depth = depth + rings.e_cos[:, i] * np.cos(turn)
        depth = depth + rings.e_sin[:, i] * np.sin(turn)
    return depth
