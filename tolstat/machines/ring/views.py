"""Views of a ring: its histories, and spectrum and stability over the speed."""

from collections.abc import Callable
from dataclasses import fields, replace
from typing import Any, NamedTuple

import numpy as np

from tolstat.arrays import Array
from tolstat.errors import ModelError
from tolstat.machines.ring import motion, parameters
from tolstat.machines.ring.declarations import Asked
from tolstat.machines.ring.flutter import NOTICED, flutter_speed
from tolstat.machines.ring.linear import growth_rate, ring_eigenvalues, static_depth
from tolstat.machines.ring.parameters import Rings
from tolstat.model import view
from tolstat.model.view import Axis, Chart, Curve, Listing, Offer, Picture, Span

MACHINES = 40  # trials with deviations, for bands
POINTS = 241  # of the range of speeds
SHOWN = 4  # frequencies, from the lowest on
NONE = np.empty(0)  # of a curve that gets its values later

# of (trials, their speeds): float64[speed, quantity]
Quantities = Callable[[Rings, Array], Array]


def chart_of(time: Array, rings: Rings, states: Array, settings: Asked) -> Chart:
    """Return the first trial: depth of cut, displacements at the tool, forces."""
    static = float(static_depth(rings, settings.hoop)[0])
    n = rings.on.s.shape[1]
    X, t_R = states[:, 4 * n], parameters.depth_of_cut(rings, states, time)
    tool_, ring_, lobes = parameters.parts_of(rings, settings.hoop)
    blank = motion.depth_of_cut(
        time, 0.0 * states.T, lobes, tool_._replace(t_R0=0.0), ring_
    )
    U = t_R - rings.t_R0 - X - blank
    P_R, P_T = motion.cutting_forces(t_R, rings)
    firsts = motion.derivative(states.T, P_R, P_T, tool_, ring_, states.T.copy())
    pulls = motion.reactions(*firsts, P_R, P_T, tool_)
    words = "of the ring at the tool, outwards"
    depth = Curve("depth_min", "m", "t_R", "depth of cut", t_R)
    ring = Curve("ring_displacement", "m", "U", words, U)
    tool = Curve("tool_travel", "m", "X_P", "displacement of the tool", X)
    round_ = Curve("blank", "m", "", "out-of-roundness of the blank", blank)
    forces = (
        Curve("radial_force_peak", "N", "P_R", "radial cutting force", P_R),
        Curve("tangential_force_peak", "N", "P_T", "tangential cutting force", P_T),
    )
    words = "force of the roller on the ring, outwards"
    numbered = enumerate(pulls, start=1)
    rollers = [Curve(f"roller_{i}_max", "N", f"l_{i}", words, l) for i, l in numbered]
    marks: tuple[view.Mark, ...] = ()
    if np.isfinite(t_R).all():
        lowest = int(t_R.argmin())
        marks = (
            view.Mark("depth_min", float(time[lowest]), float(t_R[lowest]), "least"),
        )
    levels = [view.Level(0.0, "out of the cut below")]
    if np.isfinite(static):
        levels.append(view.Level(static, "static depth"))
    moved_parts = (tool, ring, round_) if blank.any() else (tool, ring)
    return Chart(
        Axis("time", "s", "s"),
        time,
        (depth, ring, tool, round_, *forces, *rollers),
        marks=marks,
        panels=(
            view.Panel.of("Depth of cut", depth, levels=tuple(levels)),
            view.Panel.of("Displacements at the tool", *moved_parts),
            view.Panel.of("Cutting forces", *forces),
            view.Panel.of("Forces of the rollers", *rollers),
        ),
    )


def varied(settings: Asked) -> tuple[dict[str, Asked], str]:
    """Return the settings with each value of `varied`, by the value as text.

    And a title, which names impossible values.
    """
    name, nominal = settings.varied, settings
    if name == "radius":
        nominal = replace(settings, inner_radius=None)
    [kind] = [f.metadata["kind"] for f in fields(settings) if f.name == name]
    unit = {"rad": "deg", "1": ""}.get(kind.unit, kind.unit)
    others: dict[str, Asked] = {}
    cannot = []
    for times in settings.varied_by:
        value = settings.nominal(name) * times
        size = np.degrees(value) if unit == "deg" else value
        words = f"{size:.6g} {unit}".strip()
        changed: Any = {name: value}
        try:
            others[f"{name.replace('_', ' ')} {words}"] = replace(nominal, **changed)
        except ModelError:
            cannot.append(words)
    return others, f"{', '.join(cannot)} impossible" if cannot else "varied"


def flutter(deviations: Array, settings: Asked) -> tuple[Span, ...]:
    """Return the shown speeds at which the first trial flutters, and the one set."""
    speed_set = Span(settings.speed, settings.speed, "speed as set")
    if settings.hoop:
        return (speed_set,)
    ring = parameters.build(deviations[:1], settings)
    onset = flutter_speed(ring.alpha, settings.support_angle, settings.harmonics)
    begins, (lower, upper) = float(onset[0] * np.sqrt(ring.nu[0])), settings.speed_range
    if begins >= upper:
        return (speed_set,)
    return Span(max(begins, lower), upper, "flutter without friction"), speed_set


class Pictured(NamedTuple):
    """Curves of one unit over the speed, whose values are columns of `Quantities`."""

    title: str
    curves: tuple[Curve, ...]  # without values; the first has a band
    of_first: str  # title where the first is shown for each value of `varied`
    levels: tuple[view.Level, ...] = ()


def over_speed(
    deviations: Array,
    settings: Asked,
    speeds: Array,
    solve: Quantities,
    *rows: Pictured,
) -> Chart:
    """Return pictures of the first trial, then of each value of `varied`."""

    def solved(row: Array, settings: Asked) -> Array:
        repeated = np.repeat(row[None], len(speeds), axis=0)
        return solve(parameters.build(repeated, settings), speeds)

    first_values, *scattered = (solved(row, settings) for row in deviations)
    others = np.array(scattered).reshape(-1, *first_values.shape)
    by_value, which = varied(settings)
    values = {w: solved(deviations[0], other) for w, other in by_value.items()}
    shaded = flutter(deviations, settings)
    pictures: list[Picture] = []
    start = 0
    for title, templates, of_first, levels in rows:
        columns = zip(templates, first_values.T[start:], strict=False)
        curves = [curve._replace(values=column) for curve, column in columns]
        first, behind = curves[0], f"{curves[0].name}, " if start else ""
        spread = view.bands_of(first.name, first.unit, others[:, :, start])
        under = [
            first._replace(name=behind + words, values=table[:, start])
            for words, table in values.items()
        ]
        pictures += [
            Picture(title, *curves, *spread, levels=levels, spans=shaded),
            Picture(f"{of_first}, {which}", *under, spans=shaded[-1:]),
        ]
        start += len(templates)
    return Chart.of(Axis("speed", "rad/s", "rad/s"), speeds, *pictures)


def spectrum(deviations: Array, settings: Asked) -> Chart:
    """Return frequencies and growth of the ring alone over the speed, Figs. 3 and 4.

    The lowest frequencies, the first with a band, and the growth with one; then the
    lowest frequency and the growth for each value of `varied`.
    """

    def quantities(rings: Rings, Omega: Array) -> Array:
        """Return the lowest frequencies, then the growth."""
        eigenvalues = ring_eigenvalues(rings, Omega, settings.hoop)
        # each frequency stands twice, as +-i omega
        omega = np.abs(eigenvalues.imag[:, ::2][:, :SHOWN])
        return np.column_stack([omega, eigenvalues.real.max(axis=1)])

    words = "natural frequency"
    omega = [
        Curve(f"frequency {i}", "rad/s", f"omega_{i}", words, NONE, shown="rad/s")
        for i in range(1, min(SHOWN, 2 * (settings.harmonics - 1)) + 1)
    ]
    tau = Curve("growth", "1/s", "tau_1", "of the ring alone", NONE)
    speeds = np.linspace(*settings.speed_range, POINTS)
    return over_speed(
        deviations, settings, speeds, quantities,
        Pictured("Natural frequencies", (*omega,), "Lowest frequency"),
        Pictured("Growth", (tau,), "Growth"),
    )  # fmt: skip


def stability(deviations: Array, settings: Asked) -> Chart:
    """Return the growth of ring and tool over the speed.

    It has a band; then each value of `varied` follows. There is a gap without static
    depth, such as above 2 sqrt nu, where the ring does not rest.
    """

    def quantities(rings: Rings, Omega: Array) -> Array:
        """Return the growth; forces follow the speed."""
        faster = Omega / rings.Omega
        cut = rings._replace(
            Omega=Omega,
            c_R=rings.c_R * faster**settings.radial_speed_exponent,
            c_T=rings.c_T * faster**settings.tangential_speed_exponent,
        )
        growth = growth_rate(cut, static_depth(cut, settings.hoop), settings.hoop)
        return growth[:, None]

    lower, upper = settings.speed_range
    # without speed a force has no size
    speeds = np.linspace(lower, upper, POINTS)[int(lower == 0.0) :]
    tau = Curve("ring and tool", "1/s", "tau_1", "growth", NONE, shown="1/s")
    words = "Growth of ring and tool"
    picture = Pictured(words, (tau,), words, (view.Level(0.0, "grows above"),))
    return over_speed(deviations, settings, speeds, quantities, picture)


def critical(deviations: Array, settings: Asked) -> Listing:
    """Return the speeds at which M_j is zero without hoop tension, and that tension."""
    j = np.arange(2.0, settings.harmonics + 1.0)
    rows = np.repeat(deviations[:1], len(j), axis=0)
    values = parameters.values_of(rows, settings)
    rings = parameters.build(rows, settings)
    Omega = j * np.sqrt(rings.nu)
    growth = ring_eigenvalues(rings, Omega, settings.hoop).real.max(axis=1)
    # where the eigenvalue is zero twice its growth is rounding
    growth = np.where(np.abs(growth) > NOTICED * Omega, growth, 0.0)
    stress = values["density"] * (Omega * values["radius"]) ** 2
    return Listing.of(
        "a harmonic, the speed at which its stiffness M_j is zero, the tension there",
        ("harmonic", "1", "count", j.astype(int)),
        ("speed", "rad/s", "rad/s", Omega),
        ("growth", "1/s", "1/s", growth),
        ("tension", "N", "kN", stress * values["width"] * values["thickness"]),
        ("hoop stress", "Pa", "MPa", stress),
    )


OFFERS = (
    Offer("spectrum", "frequencies and growth of the ring alone", spectrum, MACHINES),
    Offer("critical", "speeds at which a harmonic has no stiffness", critical),
    Offer("stability", "growth of ring and tool", stability, MACHINES),
)
