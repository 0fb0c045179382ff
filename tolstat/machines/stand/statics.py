"""Static indeterminacy of the nominal stand: what deviations alone load it with.

Members deform by F(x): meshes, shafts, rods, and the guides where they hold the yaw; x
are the positions, gear 13 is held. J = dF/dx, det J on the paper's page 2. Members in
excess of rank J can be loaded from within: degree of indeterminacy and self-stress.
"""

from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array
from tolstat.machines.stand.declarations import Settings

ZERO = 1e-9  # singular value, of the largest: below, rank J is smaller


class Loops(NamedTuple):
    """A stand at rest, rods unloaded."""

    members: tuple[str, ...]
    J: Array  # [member, unknown]: phi21, phi22, phi31, phi32, x, alpha (link: u)
    K: Array  # [member], N/m or N m/rad
    G: dict[str, Array]  # [member] by contributor: dF of a deviation, per m or rad


def loops(N: Settings, phi31: float, *, touched: bool) -> Loops:
    """Return the members with the cranks at phi31, rad; touched guides hold the yaw."""
    linked, balanced = N.variant == "equalized", N.drive == "balanced"
    sin4 = (N.h - N.r * np.sin(phi31)) / N.l
    cos4 = np.sqrt(1 - sin4**2)
    p = N.r * (np.sin(phi31) * cos4 + np.cos(phi31) * sin4)
    arm = cos4 if linked else cos4 * N.dl_s / 2
    on_10, on_11 = (N.r2 / 2, N.r2 / 2) if balanced else (N.r2, 0.0)
    table = {
        "mesh_0": (N.k3, (on_10, on_11, 0, 0, 0, 0)),
        "mesh_1": (N.k3, (N.r2, 0, N.r3, 0, 0, 0)),
        "mesh_2": (N.k3, (0, N.r2, 0, N.r3, 0, 0)),
        "shaft_12": (N.c2, (-1, 1, 0, 0, 0, 0)),
        "shaft_9": (N.c3, (0, 0, -1, 1, 0, 0)),
        "rod_1": (N.k, (0, 0, -p, 0, cos4, arm)),
        "rod_2": (N.k, (0, 0, 0, -p, cos4, -arm)),
        "guide": (N.c_s, (0, 0, 0, 0, 0, 1)),
    }
    if balanced or N.c2 == 0:
        del table["shaft_12"]
    if linked or not touched:
        del table["guide"]
    members = (*table,)

    def dF(**values: float) -> Array:
        return np.array([values.get(member, 0.0) for member in members])

    longer = np.cos(phi31) * cos4 - np.sin(phi31) * sin4  # rod, by a larger crank
    G = {
        "rod_difference": dF(rod_1=-1, rod_2=1),
        "crank_difference": dF(rod_1=-longer / 2, rod_2=longer / 2),
    }
    for i, gears in ((1, (7, 10)), (2, (8, 11))):
        rod, mesh = f"rod_{i}", dF(**{f"mesh_{i}": 1})
        G |= {
            f"rod_length_{i}": dF(**{rod: -1}),
            f"crank_radius_{i}": dF(**{rod: longer}),
            f"crank_angle_{i}": dF(**{rod: -p}),
            f"hinge_height_{i}": dF(**{rod: sin4}),
            f"tooth_position_{i}": mesh,
            # where its phase is worst
            **{f"runout_{gear}": mesh for gear in gears},
        }
    if N.contact_yaw is None:
        G["guide_clearance"] = dF(guide=-1 / N.dh)
    K, J = zip(*table.values(), strict=True)
    return Loops(members, np.array(J, float), np.array(K), G)


def closed(stand: Loops) -> Array:
    """Return the ways in which members load each other, float64[degree, member].

    They are orthonormal in energy: the null space of (K^1/2 J)^T, times K^1/2.
    """
    scale = np.sqrt(stand.K)
    scaled = scale[:, None] * stand.J
    U, sizes, _ = np.linalg.svd(scaled / np.linalg.norm(scaled, axis=0))
    null = U[:, np.count_nonzero(sizes > ZERO * sizes[0]) :].T
    return np.asarray(null * (np.abs(null) > ZERO) * scale)


def self_stress(stand: Loops) -> Array:
    """Return loads in balance without any from outside, float64[degree, member].

    1 N in rod 1, none in mesh 1, where the rods are loaded at all; then the reverse.
    """
    ways = closed(stand)
    ends = [stand.members.index(name) for name in ("rod_1", "mesh_1")]
    chosen = ways[:, [end for end in ends if ways[:, end].any()]]
    stress: Array = np.linalg.solve(chosen, ways).astype(float)
    return stress * (np.abs(stress) > ZERO)


def loads(stand: Loops) -> dict[str, Array]:
    """Return the load of each member by contributor, N or N m per m or rad.

    dN = (K - K J (J^T K J)^-1 J^T K) G, the positions of least energy: the part of K G
    that the ways of `closed` hold.
    """
    ways = closed(stand)
    return {name: ways.T @ (ways @ dF) for name, dF in stand.G.items()}
