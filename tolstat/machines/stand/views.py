"""Views of a stand: curves over time; what deviations alone load it with."""

from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array
from tolstat.machines.stand.declarations import RESPONSES, Settings
from tolstat.machines.stand.motion import Motion, State
from tolstat.model import view
from tolstat.model.view import Axis, Chart, Curve, Listing, Offer, Picture, Span

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


def loops_at_90(settings: Settings) -> dict[str, Loops]:
    """Return stands with the cranks at 90 deg, by the state of their guides."""
    states = {"free": False, "touched": True}
    return {s: loops(settings, np.pi / 2, touched=t) for s, t in states.items()}


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


def chart_of(
    time: Array, states: Array, moved: Motion, window: tuple[float, float], delta: float
) -> Chart:
    """Return the chart of a motion; the first two panels are the paper's Figs. 2 and 3.

    Loads are signed.
    """
    y = State(*states.T[: len(State._fields)])
    words = {response.name: response for response in RESPONSES}
    loads = [Curve.of(words[n], load) for n, load in moved.loads._asdict().items()]
    powers = []
    for name, power in moved.powers._asdict().items():
        sentence = words[f"{name}_energy"].sentence.removeprefix("energy ")
        sentence = sentence.replace("work", "power")
        powers.append(Curve(f"{name}_power", "W", "P", sentence, power))
    guides = (view.Level(delta, "guides touched"), view.Level(-delta, ""))
    losses = ("slide_power", "guide_power", "spin_power", "damping_power")
    return Chart(
        Axis("time", "s", "s"),
        time,
        (
            Curve("crank_position_1", "rad", "phi31", "angle of wheel 7", y.phi31),
            Curve("crank_position_2", "rad", "phi32", "angle of wheel 8", y.phi32),
            Curve("position", "m", "x", "position of the carriage", y.x),
            Curve("speed", "m/s", "x'", "speed of the carriage", y.x_),
            *loads,
            *powers,
        ),
        marks=view.peaks_of(loads, time, least=window[0]),
        spans=(Span(*window, "over which responses are taken"),),
        panels=(
            view.Panel("Moment of shaft 9", ("shaft_9_moment",)),
            view.Panel(
                "Rod forces (tension is positive)", ("rod_force_1", "rod_force_2")
            ),
            view.Panel("Yaw of the carriage", ("yaw",), levels=guides),
            view.Panel("Carriage", ("position",), right=("speed",)),
            view.Panel("Power", ("drive_power", "roll_power")),
            view.Panel("Losses", losses),
        ),
    )


LOADED = dict.fromkeys(("rod_1", "mesh_1"), "N")
LOADED |= dict.fromkeys(("shaft_12", "shaft_9", "guide"), "N m")
SMALL = 1e-3  # m, rad: the deviation whose loads are shown


def indeterminacy(_: Array, settings: Settings) -> Listing:
    """Return self-stress and the loads of deviations, with the cranks at 90 deg."""
    rows: list[tuple[str | float, ...]] = []
    degrees = []
    for guides, stand in loops_at_90(settings).items():
        stress = self_stress(stand)
        degrees.append(n := len(stress))
        numbered = [f"self-stress {i} of {n}" for i in range(1, n + 1)]
        named = list(zip(numbered, ["1 kN"] * n, 1e3 * stress, strict=True))
        for name, load in loads(stand).items():
            if load.any() and not name.endswith(("_2", "_8", "_11")):
                per = "1 mrad" if name.startswith("crank_angle") else "1 mm"
                named.append((name, per, SMALL * load))
        for name, per, load in named:
            by_member = dict(zip(stand.members, load, strict=True))
            rows.append((guides, name, per, *(by_member.get(m, 0.0) for m in LOADED)))
    heads = [(name, "1", "") for name in ("guides", "deviation", "of")]
    heads += [(name, unit, f"k{unit}") for name, unit in LOADED.items()]
    columns = zip(*rows, strict=True) if rows else [()] * len(heads)
    return Listing.of(
        "a deviation and the loads that it causes, crank 1 at 90 deg; those of chain 2 "
        f"are opposite. Degree of static indeterminacy: {degrees[0]} with the guides "
        f"free, {degrees[1]} touched",
        *((*h, np.array(column)) for h, column in zip(heads, columns, strict=True)),
    )


def indeterminacy_turn(_: Array, settings: Settings) -> Chart:
    """Return the loads of deviations of chain 1 over a turn, guides touched."""
    turn = np.linspace(0.0, 2 * np.pi, 181)
    stands = [loops(settings, phi, touched=True) for phi in turn]
    members, by_angle = stands[0].members, [loads(stand) for stand in stands]
    names = [n for n in by_angle[0] if n.endswith("_1") or n == "guide_clearance"]
    load = {name: SMALL * np.array([dN[name] for dN in by_angle]) for name in names}
    words = "load of 1 mm or 1 mrad"
    pictures = []
    for member in ("rod_1", "shaft_9"):
        unit, row = LOADED[member], members.index(member)
        curves = [
            Curve(f"{member}, {name}", unit, "dN", words, load[name][:, row])
            for name in names
        ]
        pictures.append(Picture(f"Load of {member}, by 1 mm or 1 mrad", *curves))
    return Chart.of(Axis("crank position", "rad", "deg"), turn, *pictures)


OFFERS = (
    Offer("indeterminacy", "loads that deviations alone cause, at rest", indeterminacy),
    Offer("indeterminacy_turn", "these loads over a turn", indeterminacy_turn),
)
