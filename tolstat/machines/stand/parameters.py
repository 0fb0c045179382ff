"""Parts of a stand from its deviations, and the parameters of the equations."""

from collections import namedtuple
from collections.abc import Mapping
from functools import lru_cache
from math import asinh, hypot

import numpy as np

from tolstat.arrays import Array, Truths
from tolstat.machines.stand import declarations
from tolstat.machines.stand.declarations import NAMES, RELATIVE, Settings

# the parts with their deviations, float64[n] each, SI
Parts = namedtuple(
    "Parts",
    "l1 l2 r_1 r_2 h_1 h_2 a_1 a_2 dl_s dh k30 k31 k32 k1 k2 H1 H2 half_c1 half_c2 "
    "I1 I2 I_s m mu c2 c3 c_s Hk3 Hc2 Hc3 H_s delta F0",
)
# numbers of one trial, SI, as the equations name them, each float64[n]. Reciprocals
# are hoisted out of the equations: a division costs as much as ten multiplications
# there. B maps (phi1, a_1, a_2) to the deformations of meshes 0, 1, 2 and shaft 12;
# E7c = E7 cos th7, E7s = E7 sin th7, ...; link is 1 with the equalizing link, else 0.
Parameters = namedtuple(
    "Parameters",
    "omega0 t1 per_t1 phi1_0 "  # drive law
    "B00 B01 B02 B10 B11 B12 B20 B21 B22 B30 B31 B32 "  # gears
    "k30 k31 k32 c2 Hk3 Hc2 s1 s2 i3 per_r3 "
    "E7c E8c E10c E11c E7s E8s E10s E11s "  # run-out
    "per_I1 per_I2 c3 Hc3 cos_psi1 cos_psi2 sin_psi1 sin_psi2 "  # wheels, shaft 9
    "r_1 r_2 l1 l2 k1 k2 H1 H2 half_c1 half_c2 link "  # cranks, rods
    "m per_m I_s per_I_s h_1 h_2 dl_s off skew dh "  # carriage
    "mu mu_rot g c_s H_s delta F0 x_roll beta1 beta2 beta3 beta4 beta5",
)
# settings that no contributor changes
SAME = ("g", "x_roll", *(f"beta{i}" for i in range(1, 6)))


def named(deviations: Array) -> dict[str, Array]:
    """Return deviations[trial, contributor] by name."""
    return dict(zip(NAMES, deviations.T, strict=True))


def parts_of(d: Mapping[str, Array], settings: Settings) -> Parts:
    """Return the parts of trials, from deviations d by name."""
    N = settings
    dl, dr = d["rod_difference"], d["crank_difference"]
    k30, k31, k32 = (N.k3 * (1 + d[f"mesh_stiffness_{i}"]) for i in range(3))
    k1, k2 = (N.k * (1 + d[f"rod_stiffness_{i}"]) for i in (1, 2))
    I1, I2 = (N.I * (1 + d[f"wheel_inertia_{i}"]) for i in (1, 2))
    a_1, a_2 = (N.dl_s / 2 + d[f"hinge_arm_{i}"] for i in (1, 2))
    dh = N.dh + d["guide_length"]
    relative = {s: getattr(N, s) * (1 + d[name]) for s, name in RELATIVE.items()}
    if settings.drive == "balanced":  # without shaft 12
        relative |= {"c2": 0.0 * relative["c2"], "Hc2": 0.0 * relative["Hc2"]}
    delta = (N.dL + d["guide_clearance"]) / dh
    if settings.contact_yaw is not None:
        delta = np.full_like(dh, settings.contact_yaw)
    return Parts(
        l1=N.l + dl + d["rod_length_1"],
        l2=N.l - dl + d["rod_length_2"],
        r_1=N.r - dr / 2 + d["crank_radius_1"],
        r_2=N.r + dr / 2 + d["crank_radius_2"],
        h_1=N.h + d["hinge_height_1"], h_2=N.h + d["hinge_height_2"],
        a_1=a_1, a_2=a_2, dl_s=a_1 + a_2, dh=dh, delta=delta,
        k30=k30, k31=k31, k32=k32, k1=k1, k2=k2,
        H1=N.H * k1 / N.k * (1 + d["rod_damping_1"]),
        H2=N.H * k2 / N.k * (1 + d["rod_damping_2"]),
        half_c1=d["joint_clearance_1"] / 2, half_c2=d["joint_clearance_2"] / 2,
        I1=I1, I2=I2, **relative,
    )  # fmt: skip


def initial_position(p: Parts | Parameters) -> tuple[Array, Array, Array]:
    """Return the leftmost position of the carriage, (10), (11), each float64[n].

    phi31 = phi32 (rad), x (m), sin alpha; NaN where the parts cannot be mounted.
    """
    reach1, reach2 = p.l1 - p.r_1, p.l2 - p.r_2
    with np.errstate(invalid="ignore", divide="ignore"):
        phi = -(np.arcsin(p.h_1 / reach1) + np.arcsin(p.h_2 / reach2)) / 2
        xa = np.sqrt(reach1**2 - p.h_1**2)
        xb = np.sqrt(reach2**2 - p.h_2**2)
        return phi, (xa + xb) / 2, (xa - xb) / p.dl_s


def faults(deviations: Array, settings: Settings) -> dict[str, Truths]:
    """Return which trials cannot be built, by the words of `FAILURES`."""
    d, N = named(deviations), settings
    p = parts_of(d, settings)
    # c2 may be zero by a sum of deviations or by the balanced drive, never negative
    positive = np.minimum.reduce(
        [p.l1, p.l2, p.r_1, p.r_2, p.a_1, p.a_2, p.dh, p.dl_s - 2 * N.foot, p.k30,
         p.k31, p.k32, p.k1, p.k2, p.I1, p.I2, p.I_s, p.m, p.c3, p.c_s, p.delta]
    )  # fmt: skip
    not_negative = np.minimum.reduce(
        [p.c2, p.mu, p.F0, p.H1, p.H2, p.Hk3, p.Hc2, p.Hc3, p.H_s, p.half_c1, p.half_c2]
    )
    reach = np.minimum(p.l1 - p.r_1 - np.abs(p.h_1), p.l2 - p.r_2 - np.abs(p.h_2))
    _, _, sin_alpha = initial_position(p)
    radii = {7: N.r3, 8: N.r3, 10: N.r2, 11: N.r2}
    eccentricity = [np.abs(d[f"runout_{i}"]) / r for i, r in radii.items()]
    eccentricity += [np.abs(d[f"tooth_position_{i}"]) / N.r3 for i in (1, 2)]
    return {
        declarations.NOTHING: ~((positive > 0) & (not_negative >= 0)),
        declarations.NO_REACH: ~(reach > 0),
        declarations.NO_FIT: ~(np.abs(sin_alpha) < 1),
        declarations.OFF_CENTRE: ~(np.maximum.reduce(eccentricity) < 1),
    }


def gear_deformations(parts: Parts, settings: Settings) -> Array:
    """Condense the massless pinions 10, 11 out of the second loop.

    phi21, phi22 minimise the elastic energy of meshes 0, 1, 2 and shaft 12 for given
    (phi1, a_1, a_2), rad: float64[n, 4, 3], B, the deformations of the meshes (m) and
    of the shaft (rad).
    """
    r1, r2, r3 = settings.r1, settings.r2, settings.r3
    # mesh 0 feels pinion 10, or with the differential the mean of both pinions
    on_10, on_11 = (r2 / 2, r2 / 2) if settings.drive == "balanced" else (r2, 0.0)
    driven = np.array([[r1, 0, 0], [0, r3, 0], [0, 0, r3], [0, 0, 0]])
    pinions = np.array([[on_10, on_11], [r2, 0], [0, r2], [-1, 1]])
    K = np.stack([parts.k30, parts.k31, parts.k32, parts.c2], axis=-1)[:, :, None]
    T = -np.linalg.solve(pinions.T @ (K * pinions), pinions.T @ (K * driven))
    return np.asarray(driven + pinions @ T)


@lru_cache
def friction_arm(dh: float, dl_s: float, foot: float) -> float:
    """Return mu_rot/mu of (8), m: mean distance of the feet from the yaw axis.

    The integral of hypot over a rectangle from the origin in closed form.
    """

    def integral(a: float, b: float) -> float:
        return (2 * a * b * hypot(a, b) + a**3 * asinh(b / a) + b**3 * asinh(a / b)) / 6

    S = 2 * dh * foot
    quarter = integral(dh / 2, dl_s / 2) - integral(dh / 2, dl_s / 2 - foot)
    return 4 * quarter / S


def build(deviations: Array, settings: Settings) -> Parameters:
    """Return the parameters of deviations[trial, contributor], each float64[n]."""
    d, N = named(deviations), settings
    parts = parts_of(d, settings)
    psi1, psi2 = (d[f"crank_angle_{i}"] for i in (1, 2))
    run_out: dict[str, Array] = {}
    for i in (7, 8, 10, 11):
        E, th = d[f"runout_{i}"], d[f"runout_phase_{i}"]
        run_out |= {f"E{i}c": E * np.cos(th), f"E{i}s": E * np.sin(th)}
    phi31_0, _, _ = initial_position(parts)
    B = gear_deformations(parts, settings)
    ones = np.ones_like(parts.m)
    feet = zip(parts.dh.tolist(), parts.dl_s.tolist(), strict=True)
    arm = np.array([friction_arm(dh, dl_s, N.foot) for dh, dl_s in feet])
    # the equations take wheels by the reciprocals of their inertias
    parted = parts._asdict()
    a_1, a_2 = parted.pop("a_1"), parted.pop("a_2")
    per_I1, per_I2 = 1 / parted.pop("I1"), 1 / parted.pop("I2")

    return Parameters(
        **parted,
        # drive law
        omega0=settings.crank_speed * N.r3 / N.r1 * ones,
        t1=settings.start_up * ones,
        per_t1=ones / settings.start_up,
        phi1_0=phi31_0 * N.r3 / N.r1,
        # gears
        **{f"B{i}{j}": B[:, i, j] for i in range(4) for j in range(3)},
        i3=N.r3 / N.r2 * ones, per_r3=1 / N.r3 * ones,
        s1=d["tooth_position_1"], s2=d["tooth_position_2"],
        **run_out,
        # wheels
        per_I1=per_I1, per_I2=per_I2,
        cos_psi1=np.cos(psi1), sin_psi1=np.sin(psi1),
        cos_psi2=np.cos(psi2), sin_psi2=np.sin(psi2),
        # rods
        link=ones * (settings.variant == "equalized"),
        # carriage
        off=(a_1 - a_2) / 2, skew=(a_1 - a_2) / parts.dl_s,
        per_m=1 / parts.m, per_I_s=1 / parts.I_s,
        mu_rot=parts.mu * arm,
        **{name: getattr(N, name) * ones for name in SAME},
    )  # fmt: skip
