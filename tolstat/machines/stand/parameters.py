"""The machine as built: what the equations take, from the deviations of its parts."""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Mapping
from math import asinh, hypot

import numpy as np

from tolstat.arrays import Array
from tolstat.machines.stand.declarations import Settings
from tolstat.machines.stand.nominal import NOMINAL
from tolstat.machines.stand.parts import faults, initial_position, parts_of

# numbers of one machine, SI, as the equations name them, each float64[n]. Reciprocals
# are hoisted out of the equations: a division costs as much as ten multiplications
# there. B maps (phi1, a_1, a_2) to the deformations of meshes 0, 1, 2 and shaft 12;
# E7c = E7 cos th7, E7s = E7 sin th7, ...; link is 1 with the equalizing link, else 0.
Parameters = namedtuple(
    "Parameters",
    "omega0 t1 per_t1 phi1_0 "  # drive law
    "B00 B01 B02 B10 B11 B12 B20 B21 B22 B30 B31 B32 "  # gears
    "k30 k31 k32 c2 Hc2 s1 s2 "
    "E7c E8c E10c E11c E7s E8s E10s E11s "  # run-out
    "per_I1 per_I2 c3 cos_psi1 cos_psi2 sin_psi1 sin_psi2 r_1 r_2 "  # wheels, shaft 9
    "l1 l2 k1 k2 H1 H2 link "  # rods
    "m per_m mu mu_rot delta F0",  # carriage
)


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
        return (2 * a * b * hypot(a, b) + a**3 * asinh(b / a) + b**3 * asinh(a / b)) / 6

    S = 2 * dh * foot
    quarter = integral(dh / 2, dl_s / 2) - integral(dh / 2, dl_s / 2 - foot)
    return 4 * quarter / S


def build(deviations: Mapping[str, Array], settings: Settings) -> Parameters:
    """Build machines from the deviations of their parts.

    Returns
    -------
    p : Parameters
        Each float64[n]; the drive law is NaN for a machine that cannot be built.
    """
    d, N = deviations, NOMINAL
    parts = parts_of(d, settings)
    l1, l2, r_1, r_2, k30, k31, k32, k1, k2, I1, I2, m, mu, c2, c3, delta, F0 = parts
    psi1, psi2 = (d[f"crank_angle_{i}"] for i in (1, 2))
    E7, E8, E10, E11 = (d[f"runout_{i}"] for i in (7, 8, 10, 11))
    th7, th8, th10, th11 = (d[f"runout_phase_{i}"] for i in (7, 8, 10, 11))
    omega0 = settings.crank_speed * N.r3 / N.r1
    phi31_0, _, _ = initial_position(l1, l2, r_1, r_2)
    balanced = settings.drive == "balanced"
    B = gear_deformations(k30, k31, k32, c2, balanced)
    one = np.where(np.any([*faults(parts, d).values()], axis=0), np.nan, 1.0)

    return Parameters(
        # drive law
        omega0=omega0 * one,
        t1=settings.start_up * one,
        per_t1=one / settings.start_up,
        phi1_0=phi31_0 * N.r3 / N.r1 * one,
        # gears
        B00=B[:, 0, 0], B01=B[:, 0, 1], B02=B[:, 0, 2],
        B10=B[:, 1, 0], B11=B[:, 1, 1], B12=B[:, 1, 2],
        B20=B[:, 2, 0], B21=B[:, 2, 1], B22=B[:, 2, 2],
        B30=B[:, 3, 0], B31=B[:, 3, 1], B32=B[:, 3, 2],
        k30=k30, k31=k31, k32=k32,
        c2=c2,
        Hc2=np.full_like(m, 0.0 if balanced else N.Hc2),
        s1=d["tooth_position_1"], s2=d["tooth_position_2"],
        # run-out
        E7c=E7 * np.cos(th7), E7s=E7 * np.sin(th7),
        E8c=E8 * np.cos(th8), E8s=E8 * np.sin(th8),
        E10c=E10 * np.cos(th10), E10s=E10 * np.sin(th10),
        E11c=E11 * np.cos(th11), E11s=E11 * np.sin(th11),
        # wheels and shaft 9
        per_I1=1 / I1, per_I2=1 / I2,
        c3=c3,
        cos_psi1=np.cos(psi1), sin_psi1=np.sin(psi1),
        cos_psi2=np.cos(psi2), sin_psi2=np.sin(psi2),
        r_1=r_1, r_2=r_2,
        # rods
        l1=l1, l2=l2,
        k1=k1, k2=k2,
        H1=N.H * k1 / N.k, H2=N.H * k2 / N.k,
        link=np.full_like(m, 1.0 if settings.variant == "equalized" else 0.0),
        # carriage
        m=m, per_m=1 / m,
        mu=mu, mu_rot=mu * friction_arm(),
        delta=delta,
        F0=F0,
    )  # fmt: skip
