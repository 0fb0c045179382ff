"""Rings as built, from the deviations of their parts."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array, Truths
from tolstat.errors import ModelError
from tolstat.machines.ring.declarations import (
    RELATIVE,
    Asked,
    amplitude,
    description_of,
    phase,
)
from tolstat.machines.ring.harmonics import Place, Supported, nu_of, place, supported


class Rings(NamedTuple):
    """Machines by the paper's letters, SI, each float64[trial] but where said."""

    r: Array  # m, middle line
    h: Array  # m
    nu: Array  # 1/s2, E J/(rho F r^4)
    pi_chi: Array  # kg, pi r rho F
    K_T: Array  # s
    alpha: Array  # rad, half the angle between the supports
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
    at: Place  # [trial, harmonic], where the tool stands
    lobes: tuple[int, ...]  # harmonics k that the blank may be out of round
    e_cos: Array  # [trial, lobe], m: e_k cos(k theta_R + psi_k)
    e_sin: Array  # [trial, lobe], m: e_k sin(k theta_R + psi_k)
    exists: Truths  # the rows of others hold the nominal machine


def build(deviations: Array, settings: Asked) -> Rings:
    """Build machines from the deviations of their parts."""
    names = [each.name for each in description_of(settings).contributors]
    given = dict(zip(names, deviations.T, strict=True))

    def built(name: str) -> Array:
        """Return a nominal value with its deviation."""
        nominal, deviation = settings.nominal(name), given[name]
        relative: Array = nominal * (1.0 + deviation)
        absolute: Array = nominal + deviation
        return relative if name in RELATIVE else absolute

    h = built("thickness")
    if settings.radius is None:
        r = settings.inner_radius_given + 0.5 * h + given["radius"]
    else:
        r = built("radius")
    E, rho, w = built("youngs_modulus"), built("density"), built("width")
    m_c, c_c, K_C = built("tool_mass"), built("tool_damping"), built("tool_stiffness")
    K_T, S, Omega = built("ring_damping"), built("feed"), built("speed")
    alpha, theta_R = 0.5 * built("support_angle"), built("tool_angle")
    scale, x_R = built("cutting_force"), built("force_exponent")

    positive = np.minimum.reduce(
        [r - 0.5 * h, h, E, rho, w, m_c, K_C, S, Omega, x_R, alpha, 0.5 * np.pi - alpha]
    )
    exists = (positive > 0.0) & (np.minimum.reduce([c_c, K_T, scale]) >= 0.0)
    if not exists.all():
        if not deviations[~exists].any():
            raise ModelError("the nominal ring cannot exist: a size leaves the doubles")
        # an eigenvalue problem is made of every row
        kept = np.where(exists[:, None], deviations, 0.0)
        return build(kept, settings)._replace(exists=exists)

    F = w * h
    V = 60.0 * Omega * (r + 0.5 * h)

    def at_1_mm(which: str) -> Array:
        """Return a force at a depth of 1 mm, (10): mm, mm a turn, m/min."""
        names = ("coefficient", "feed_exponent", "speed_exponent")
        C, y, n = (float(getattr(settings, f"{which}_{name}")) for name in names)
        found: Array = 10.0 * scale * C * S**y * V**n
        return found

    on = supported(alpha, settings.harmonics)
    lobes = [
        (built(amplitude(k)), k * theta_R + built(phase(k)))
        for k in settings.out_of_roundness_harmonics
    ]
    return Rings(
        r=r, h=h, nu=nu_of(E, rho, w, h, r), pi_chi=np.pi * r * rho * F, K_T=K_T,
        alpha=alpha, Omega=Omega, t_R0=built("depth"),
        c_R=at_1_mm("radial"), x_R=x_R,
        c_T=at_1_mm("tangential"),
        x_T=np.full_like(r, settings.tangential_depth_exponent),
        m_c=m_c, c_c=c_c, K_C=K_C,
        on=on, at=place(theta_R, on),
        lobes=settings.out_of_roundness_harmonics,
        e_cos=np.stack([e * np.cos(psi) for e, psi in lobes], axis=1),
        e_sin=np.stack([e * np.sin(psi) for e, psi in lobes], axis=1),
        exists=exists,
    )  # fmt: skip


def force(c: Array, x: Array, t: Array) -> Array:
    """Return a cutting force, N, at depths t, m, (10); none below zero."""
    found: Array = np.where(t > 0.0, c * np.maximum(1e3 * t, 0.0) ** x, 0.0)
    return found


def out_of_roundness(rings: Rings, t: Array | float) -> Array:
    """Return what the blank adds to the depth, m, at a time, s.

    float64[trial]; of a machine alone at several times, float64[time].
    """
    found = 0.0 * rings.r
    for i, k in enumerate(rings.lobes):
        turn = k * rings.Omega * t
        found = found + rings.e_cos[:, i] * np.cos(turn)
        found = found + rings.e_sin[:, i] * np.sin(turn)
    return found
