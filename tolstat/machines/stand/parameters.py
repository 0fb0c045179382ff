"""The machine as built: parameters of the equations from the deviations of its parts.

References
----------
E. Ya. Antonyuk, A. G. Zabuga, On the dynamic loading of machines with parallel
statically indeterminate kinematic chains (2012); equation numbers are the paper's.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.machines.stand.settings import Settings

Array = NDArray[np.float64]

# Nominal machine, SI. The paper's letters; what it prints, before equation (1).
NOMINAL = SimpleNamespace(
    m=7800.0,  # kg, carriage
    I_s=2770.0,  # kg m2, carriage about the vertical
    dl_s=0.864,  # m, carriage between the rod hinges
    dh=1.5,  # m, carriage along the guides
    dL=0.0025,  # m, side clearance in the guides
    foot=0.1,  # m, width of the carriage's feet
    mu=0.05,
    l=2.45,  # m, rods
    k=9.4e7,  # N/m
    H=188000.0,  # N s/m, follows k rod by rod
    r=0.35,  # m, cranks
    I=130.0,  # kg m2, wheels 7, 8
    r3=0.546,  # m
    c3=6.9e6,  # N m/rad, shaft 9
    Hc3=13800.0,  # N m s/rad
    k3=3.44e9,  # N/m, tooth meshes
    Hk3=68800.0,  # N s/m
    r2=0.21,  # m, pinions 10, 11
    c2=8.6e6,  # N m/rad, shaft 12
    Hc2=17200.0,  # N m s/rad
    r1=0.21,  # m, gear 13
    h=0.28,  # m, rod hinges above the wheel axis
    F0=29400.0,  # N, rolling force
    x_roll=2.2,  # m, where it begins
    beta1=1e3,  # 1/m
    beta2=1e3,  # s/m
    beta3=1e6,  # 1/rad
    beta4=1e8,  # 1/rad
    beta5=1e5,  # s/rad
    c_s=1e8,  # N m/rad, contact with the guides
    H_s=2e5,  # N m s/rad
    g=9.81,  # m/s2
)


class Parameters(NamedTuple):
    """Numbers of one machine, SI, as the equations name them.

    Reciprocals are hoisted out of the equations: a division costs as much as ten
    multiplications there.
    """

    # drive law
    omega0: Array
    t1: Array
    per_t1: Array
    phi1_0: Array
    # gears: B maps (phi1, a_1, a_2) to the deformations of meshes 0, 1, 2 and shaft 12
    B00: Array
    B01: Array
    B02: Array
    B10: Array
    B11: Array
    B12: Array
    B20: Array
    B21: Array
    B22: Array
    B30: Array
    B31: Array
    B32: Array
    k30: Array
    k31: Array
    k32: Array
    c2: Array
    Hc2: Array
    s1: Array
    s2: Array
    # run-out: E7c = E7 cos th7, E7s = E7 sin th7, ...
    E7c: Array
    E8c: Array
    E10c: Array
    E11c: Array
    E7s: Array
    E8s: Array
    E10s: Array
    E11s: Array
    # wheels and shaft 9
    per_I1: Array
    per_I2: Array
    c3: Array
    cos_psi1: Array
    cos_psi2: Array
    sin_psi1: Array
    sin_psi2: Array
    r_1: Array
    r_2: Array
    # rods
    l1: Array
    l2: Array
    k1: Array
    k2: Array
    H1: Array
    H2: Array
    link: Array  # 1 with the equalizing link, 0 without
    # carriage
    m: Array
    per_m: Array
    mu: Array
    mu_rot: Array
    delta: Array
    F0: Array


def build(deviations: Mapping[str, Array], settings: Settings) -> Parameters:
    """Build machines from the deviations of their parts.

    Parameters
    ----------
    deviations : mapping of str to float64[n]
        By contributor name, SI, every contributor of the stand.
    settings : Settings
        Variant, drive, speed.

    Returns
    -------
    p : Parameters
        Each float64[n]; NaN throughout for a machine that cannot exist, whose trial
        then ends as "not finite".
    """
    d, N = deviations, NOMINAL
    dl, dr = d["rod_difference"], d["crank_difference"]
    l1 = N.l + dl + d["rod_length_1"]
    l2 = N.l - dl + d["rod_length_2"]
    r_1 = N.r - dr / 2 + d["crank_radius_1"]
    r_2 = N.r + dr / 2 + d["crank_radius_2"]
    k30, k31, k32 = (N.k3 * (1 + d[f"mesh_stiffness_{i}"]) for i in range(3))
    k1, k2 = (N.k * (1 + d[f"rod_stiffness_{i}"]) for i in (1, 2))
    I1, I2 = (N.I * (1 + d[f"wheel_inertia_{i}"]) for i in (1, 2))
    m = N.m * (1 + d["carriage_mass"])
    mu = N.mu * (1 + d["friction"])
    c3 = N.c3 * (1 + d["shaft_9_stiffness"])
    balanced = settings.drive == "balanced"
    c2 = 0 * m if balanced else N.c2 * (1 + d["shaft_12_stiffness"])
    delta = (N.dL + d["guide_clearance"]) / N.dh
    if settings.contact_yaw is not None:
        delta = 0 * delta + settings.contact_yaw
    omega0 = settings.crank_speed * N.r3 / N.r1
    runout = [(d[f"runout_{i}"], d[f"runout_phase_{i}"]) for i in (7, 8, 10, 11)]
    phi31_0, _, _ = initial_position(l1, l2, r_1, r_2)

    # c2 may be zero by a sum of deviations or by the balanced drive, never negative
    positive = np.minimum.reduce(
        [l1, l2, r_1, r_2, k30, k31, k32, k1, k2, I1, I2, m, c3, delta]
    )
    exists = (positive > 0) & (c2 >= 0) & (mu >= 0)
    one = np.where(exists, 1.0, np.nan)

    B = gear_deformations(k30, k31, k32, c2, balanced)
    return Parameters(
        *np.broadcast_arrays(
            omega0 * one,
            settings.start_up * one,
            one / settings.start_up,
            phi31_0 * N.r3 / N.r1 * one,
            *(B[:, i, j] for i in range(4) for j in range(3)),
            k30,
            k31,
            k32,
            c2,
            0.0 if balanced else N.Hc2,
            d["tooth_position_1"],
            d["tooth_position_2"],
            *(E * np.cos(th) for E, th in runout),
            *(E * np.sin(th) for E, th in runout),
            1 / I1,
            1 / I2,
            c3,
            *(np.cos(d[f"crank_angle_{i}"]) for i in (1, 2)),
            *(np.sin(d[f"crank_angle_{i}"]) for i in (1, 2)),
            r_1,
            r_2,
            l1,
            l2,
            k1,
            k2,
            N.H * k1 / N.k,
            N.H * k2 / N.k,
            1.0 if settings.variant == "equalized" else 0.0,
            m,
            1 / m,
            mu,
            mu * friction_arm(),
            delta,
            N.F0 * (1 + d["rolling_force"]),
        )
    )


def initial_position(
    l1: Array, l2: Array, r_1: Array, r_2: Array
) -> tuple[Array, Array, Array]:
    """Place the carriage in its leftmost position, (10), (11).

    Parameters
    ----------
    l1, l2, r_1, r_2 : float64[n]
        Rods and cranks, m.

    Returns
    -------
    tuple of float64[n]
        phi31 = phi32 (rad), x (m), sin alpha; NaN where the parts cannot be mounted.
    """
    h, dl_s = NOMINAL.h, NOMINAL.dl_s
    with np.errstate(invalid="ignore", divide="ignore"):
        phi = -(np.arcsin(h / (l1 - r_1)) + np.arcsin(h / (l2 - r_2))) / 2
        xa = np.sqrt((l1 - r_1) ** 2 - h**2)
        xb = np.sqrt((l2 - r_2) ** 2 - h**2)
    return phi, (xa + xb) / 2, (xa - xb) / dl_s


def gear_deformations(
    k30: Array, k31: Array, k32: Array, c2: Array, balanced: bool
) -> Array:
    """Condense the massless pinions 10, 11 out of the second loop.

    phi21, phi22 minimise the elastic energy of meshes 0, 1, 2 and shaft 12 for given
    (phi1, a_1, a_2).

    Parameters
    ----------
    k30, k31, k32, c2 : float64[n]
        Stiffness of the meshes, N/m, and of shaft 12, N m/rad.
    balanced : bool
        Whether a differential splits the torque of gear 13 between the pinions.

    Returns
    -------
    float64[n, 4, 3]
        B: deformations of meshes 0, 1, 2 (m) and of shaft 12 (rad) for
        (phi1, a_1, a_2), rad.
    """
    r1, r2, r3 = NOMINAL.r1, NOMINAL.r2, NOMINAL.r3
    # mesh 0 feels pinion 10, or with the differential the mean of both pinions
    on_10, on_11 = (r2 / 2, r2 / 2) if balanced else (r2, 0.0)
    driven = np.array([[r1, 0, 0], [0, r3, 0], [0, 0, r3], [0, 0, 0]])
    pinions = np.array([[on_10, on_11], [r2, 0], [0, r2], [-1, 1]])
    K = np.stack(np.broadcast_arrays(k30, k31, k32, c2), axis=-1)[:, :, None]
    T = -np.linalg.solve(pinions.T @ (K * pinions), pinions.T @ (K * driven))
    B: Array = driven + pinions @ T
    return B


def friction_arm() -> float:
    """Return mu_rot/mu of (8), m: mean distance of the feet from the yaw axis.

    The integral of hypot over a rectangle from the origin in closed form.
    """
    dh, dl_s, foot = float(NOMINAL.dh), float(NOMINAL.dl_s), float(NOMINAL.foot)

    def integral(a: float, b: float) -> float:
        return (
            2 * a * b * math.hypot(a, b)
            + a**3 * math.asinh(b / a)
            + b**3 * math.asinh(a / b)
        ) / 6

    S = 2 * dh * foot
    quarter = integral(dh / 2, dl_s / 2) - integral(dh / 2, dl_s / 2 - foot)
    return 4 * quarter / S
