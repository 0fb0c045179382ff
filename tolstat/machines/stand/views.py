"""Views of a stand: curves over time; what deviations alone load it with."""

import numpy as np

from tolstat.arrays import Array
from tolstat.machines.stand.declarations import RESPONSES, Settings
from tolstat.machines.stand.motion import Motion, State
from tolstat.machines.stand.statics import loads, loops, self_stress
from tolstat.model.view import (
    Axis,
    Chart,
    Curve,
    Level,
    Listing,
    Offer,
    Panel,
    Picture,
    Span,
    peaks_of,
)


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
    guides = (Level(delta, "guides touched"), Level(-delta, ""))
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
        marks=peaks_of(loads, time, least=window[0]),
        spans=(Span(*window, "over which responses are taken"),),
        panels=(
            Panel("Moment of shaft 9", ("shaft_9_moment",)),
            Panel("Rod forces (tension is positive)", ("rod_force_1", "rod_force_2")),
            Panel("Yaw of the carriage", ("yaw",), levels=guides),
            Panel("Carriage", ("position",), right=("speed",)),
            Panel("Power", ("drive_power", "roll_power")),
            Panel("Losses", losses),
        ),
    )


LOADED = dict.fromkeys(("rod_1", "mesh_1"), "N")
LOADED |= dict.fromkeys(("shaft_12", "shaft_9", "guide"), "N m")
SMALL = 1e-3  # m, rad: the deviation whose loads are shown


def indeterminacy(_: Array, settings: Settings) -> Listing:
    """Return self-stress and the loads of deviations, with the cranks at 90 deg."""
    rows: list[tuple[str | float, ...]] = []
    degrees = []
    for touched, guides in ((False, "free"), (True, "touched")):
        stand = loops(settings, np.pi / 2, touched=touched)
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
