"""The parts as built, and what of them no stand can be built from.

References
----------
E. Ya. Antonyuk, A. G. Zabuga, On the dynamic loading of machines with parallel
statically indeterminate kinematic chains (2012); equation numbers are the paper's.
"""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Mapping

import numpy as np

from tolstat.arrays import Array, Truths
from tolstat.machines.stand.declarations import Settings
from tolstat.machines.stand.nominal import NOMINAL

NOTHING = "no part left"
NO_REACH = "rod too short"
NO_FIT = "does not fit"
OFF_CENTRE = "off its axis"
FAULTS = {
    NOTHING: "rods, cranks, clearance, stiffnesses, inertias and masses are above 0, "
    "shaft 12, friction and rolling force not below",
    NO_REACH: f"each rod is longer than its crank by more than {NOMINAL.h:g} m, the "
    "height of the hinges",
    NO_FIT: "the rods put the ends of the carriage less than its length of "
    f"{NOMINAL.dl_s:g} m apart",
    OFF_CENTRE: "run-outs and tooth positions are smaller than the wheel",
}


# what deviations make of the parts, float64[n] each, SI
Parts = namedtuple("Parts", "l1 l2 r_1 r_2 k30 k31 k32 k1 k2 I1 I2 m mu c2 c3 delta F0")


def parts_of(deviations: Mapping[str, Array], settings: Settings) -> Parts:
    """Return the parts of machines."""
    d, N = deviations, NOMINAL
    dl, dr = d["rod_difference"], d["crank_difference"]
    k30, k31, k32 = (N.k3 * (1 + d[f"mesh_stiffness_{i}"]) for i in range(3))
    k1, k2 = (N.k * (1 + d[f"rod_stiffness_{i}"]) for i in (1, 2))
    I1, I2 = (N.I * (1 + d[f"wheel_inertia_{i}"]) for i in (1, 2))
    m = N.m * (1 + d["carriage_mass"])
    balanced = settings.drive == "balanced"
    delta = (N.dL + d["guide_clearance"]) / N.dh
    if settings.contact_yaw is not None:
        delta = 0 * delta + settings.contact_yaw
    return Parts(
        l1=N.l + dl + d["rod_length_1"],
        l2=N.l - dl + d["rod_length_2"],
        r_1=N.r - dr / 2 + d["crank_radius_1"],
        r_2=N.r + dr / 2 + d["crank_radius_2"],
        k30=k30, k31=k31, k32=k32,
        k1=k1, k2=k2,
        I1=I1, I2=I2,
        m=m,
        mu=N.mu * (1 + d["friction"]),
        c2=0 * m if balanced else N.c2 * (1 + d["shaft_12_stiffness"]),
        c3=N.c3 * (1 + d["shaft_9_stiffness"]),
        delta=delta,
        F0=N.F0 * (1 + d["rolling_force"]),
    )  # fmt: skip


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


def faults(parts: Parts, deviations: Mapping[str, Array]) -> dict[str, Truths]:
    """Tell which machines cannot be built, by the words of `FAULTS`."""
    p, N = parts, NOMINAL
    # c2 may be zero by a sum of deviations or by the balanced drive, never negative
    positive = np.minimum.reduce(
        [p.l1, p.l2, p.r_1, p.r_2, p.k30, p.k31, p.k32, p.k1, p.k2, p.I1, p.I2, p.m,
         p.c3, p.delta]
    )  # fmt: skip
    not_negative = np.minimum.reduce([p.c2, p.mu, p.F0])
    reach = np.minimum(p.l1 - p.r_1, p.l2 - p.r_2)
    _, _, sin_alpha = initial_position(p.l1, p.l2, p.r_1, p.r_2)
    radii = {7: N.r3, 8: N.r3, 10: N.r2, 11: N.r2}
    off = [np.abs(deviations[f"runout_{i}"]) / r for i, r in radii.items()]
    off += [np.abs(deviations[f"tooth_position_{i}"]) / N.r3 for i in (1, 2)]
    return {
        NOTHING: ~((positive > 0) & (not_negative >= 0)),
        NO_REACH: ~(reach > N.h),
        NO_FIT: ~(np.abs(sin_alpha) < 1),
        OFF_CENTRE: ~(np.maximum.reduce(off) < 1),
    }
