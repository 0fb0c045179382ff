"""Views of a ring: its histories, and spectrum and stability over the speed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, replace
from typing import Any

import numpy as np

from tolstat.arrays import Array
from tolstat.errors import ModelError
from tolstat.machines.ring import motion
from tolstat.machines.ring.declarations import Asked
from tolstat.machines.ring.flutter import NOTICED, flutter_speed
from tolstat.machines.ring.linear import growth_rate, ring_eigenvalues, static_depth
from tolstat.machines.ring.parameters import Rings, build, out_of_roundness, values_of
from tolstat.machines.ring.trials import Trials, depth_of_cut, rows_of
from tolstat.model.view import (
    Axis,
    Band,
    Chart,
    Curve,
    Level,
    Listing,
    Mark,
    Offer,
    Panel,
    Span,
    bands_of,
)

MACHINES = 40  # trials with deviations, for bands
POINTS = 241  # of the range of speeds
SHOWN = 4  # frequencies, from the lowest on
GROWS = Level(0.0, "grows above")

# of (trials, their speeds): float64[speed, quantity]
Found = Callable[[Rings, Array], Array]


def chart_of(time: Array, trials: Trials, settings: Asked) -> Chart:
    """Return the first trial: depth of cut, displacements at the tool, forces."""
    rings, states = trials.rings, trials.solution.history[0]
    static = float(static_depth(rings, settings.hoop)[0])
    n = rings.on.s.shape[1]
    X, blank = states[:, 4 * n], out_of_roundness(rings, time)
    t_R = depth_of_cut(rings, states, time)
    U = t_R - rings.t_R0 - X - blank
    P_R, P_T = motion.cutting_forces(t_R, rings)
    machine = rows_of(rings, settings)[0, : motion.HEAD + motion.RING * n]
    tool_, ring_ = (
        motion.Tool(*machine[: motion.HEAD]),
        motion.Ring(*machine[motion.HEAD :].reshape(-1, n)),
    )
    y = states.T
    firsts = motion.derivative(y, P_R, P_T, tool_, ring_, np.empty_like(y))
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
    rollers = [
        Curve(f"roller_{i}_max", "N", f"l_{i}", words, pull)
        for i, pull in enumerate(pulls, start=1)
    ]
    marks: tuple[Mark, ...] = ()
    if np.isfinite(t_R).all():
        at = int(t_R.argmin())
        marks = (Mark("depth_min", float(time[at]), float(t_R[at]), "least"),)
    levels = [Level(0.0, "out of the cut below")]
    if np.isfinite(static):
        levels.append(Level(static, "static depth"))
    moved_parts = (tool, ring, round_) if blank.any() else (tool, ring)
    return Chart(
        Axis("time", "s", "s"),
        time,
        (depth, ring, tool, round_, *forces, *rollers),
        marks=marks,
        panels=(
            Panel.of("Depth of cut", depth, levels=tuple(levels)),
            Panel.of("Displacements at the tool", *moved_parts),
            Panel.of("Cutting forces", *forces),
            Panel.of("Forces of the rollers", *rollers),
        ),
    )


def own_and_others(
    deviations: Array, settings: Asked, speeds: Array, found: Found
) -> tuple[Array, Array]:
    """Return float64[speed, quantity] of the first, [machine, ...] of the others."""
    own, *others = (
        found(build(np.repeat(row[None], len(speeds), axis=0), settings), speeds)
        for row in deviations
    )
    return own, np.array(others).reshape(-1, *own.shape)


def varied(
    deviations: Array, settings: Asked, speeds: Array, found: Found
) -> tuple[dict[str, Array], str]:
    """Return the quantities of the first trial for each value of `varied`.

    By the value as text; and a title, which names impossible values.
    """
    name, given = settings.varied, settings
    if name == "radius":
        given = replace(settings, inner_radius=None)
    [kind] = [each.metadata["kind"] for each in fields(settings) if each.name == name]
    unit = {"rad": "deg", "1": ""}.get(kind.unit, kind.unit)
    others, cannot = {}, []
    for times in settings.varied_by:
        value = settings.nominal(name) * times
        size = np.degrees(value) if unit == "deg" else value
        words = f"{size:.6g} {unit}".strip()
        changed: Any = {name: value}
        try:
            others[f"{name.replace('_', ' ')} {words}"] = replace(given, **changed)
        except ModelError:
            cannot.append(words)
    values = {
        words: own_and_others(deviations[:1], other, speeds, found)[0]
        for words, other in others.items()
    }
    return values, f"{', '.join(cannot)} impossible" if cannot else "varied"


def flutter(deviations: Array, settings: Asked) -> tuple[Span, ...]:
    """Return the shown speeds at which the first trial flutters, and the one set."""
    own = Span(settings.speed, settings.speed, "speed as set")
    if settings.hoop:
        return (own,)
    ring = build(deviations[:1], settings)
    onset = flutter_speed(ring.alpha, settings.support_angle, settings.harmonics)
    begins, (lower, upper) = float(onset[0] * np.sqrt(ring.nu[0])), settings.speed_range
    if begins >= upper:
        return (own,)
    return Span(max(begins, lower), upper, "flutter without friction"), own


def spectrum(deviations: Array, settings: Asked) -> Chart:
    """Return frequencies and growth of the ring alone over the speed, Figs. 3 and 4.

    The lowest frequencies, the first with a band, and the growth with one; then the
    lowest frequency and the growth for each value of `varied`.
    """
    speeds = np.linspace(*settings.speed_range, POINTS)

    def found(rings: Rings, Omega: Array) -> Array:
        """Return the lowest frequencies, then the growth."""
        each = ring_eigenvalues(rings, Omega, settings.hoop)
        # each frequency stands twice, as +-i omega
        omega = np.abs(each.imag[:, ::2][:, :SHOWN])
        return np.column_stack([omega, each.real.max(axis=1)])

    def omega(name: str, i: int, words: str, column: Array) -> Curve:
        return Curve(name, "rad/s", f"omega_{i}", words, column, shown="rad/s")

    def tau(name: str, column: Array) -> Curve:
        return Curve(name, "1/s", "tau_1", "of the ring alone", column)

    own, others = own_and_others(deviations, settings, speeds, found)
    frequencies = [
        omega(f"frequency {i}", i, "natural frequency", column)
        for i, column in enumerate(own.T[:-1], start=1)
    ]
    growth = tau("growth", own[:, -1])
    lowest_band = bands_of("frequency 1", "rad/s", others[:, :, 0])
    grown = bands_of("growth", "1/s", others[:, :, -1])
    values, title = varied(deviations, settings, speeds, found)
    lowest = [omega(v, 1, "lowest frequency", f[:, 0]) for v, f in values.items()]
    growths = [tau(f"growth, {v}", f[:, -1]) for v, f in values.items()]
    shaded = flutter(deviations, settings)
    return Chart(
        Axis("speed", "rad/s", "rad/s"),
        speeds,
        (*frequencies, growth, *lowest, *growths),
        (*lowest_band, *grown),
        panels=(
            Panel.of("Natural frequencies", *frequencies, *lowest_band, spans=shaded),
            Panel.of("Growth", growth, *grown, spans=shaded),
            Panel.of(f"Lowest frequency, {title}", *lowest, spans=shaded[-1:]),
            Panel.of(f"Growth, {title}", *growths, spans=shaded[-1:]),
        ),
    )


def stability(deviations: Array, settings: Asked) -> Chart:
    """Return the growth of ring and tool, and of the ring alone, over the speed.

    Both have bands; then each value of `varied` follows. There is a gap without static
    depth, such as above 2 sqrt nu, where the ring does not rest.
    """
    lower, upper = settings.speed_range
    # without speed a force has no size
    speeds = np.linspace(lower, upper, POINTS)[int(lower == 0.0) :]

    def found(rings: Rings, Omega: Array) -> Array:
        """Return the growth with the tool, then alone; forces follow the speed."""
        faster = Omega / rings.Omega
        cut = rings._replace(
            Omega=Omega,
            c_R=rings.c_R * faster**settings.radial_speed_exponent,
            c_T=rings.c_T * faster**settings.tangential_speed_exponent,
        )
        both = growth_rate(cut, static_depth(cut, settings.hoop), settings.hoop)
        alone = ring_eigenvalues(rings, Omega, settings.hoop).real.max(axis=1)
        return np.column_stack([both, alone])

    own, others = own_and_others(deviations, settings, speeds, found)
    values, title = varied(deviations, settings, speeds, found)
    shaded = flutter(deviations, settings)
    curves: list[Curve] = []
    spread: list[Band] = []
    panels: list[Panel] = []

    def curve(name: str, words: str, column: Array) -> Curve:
        return Curve(name, "1/s", "tau_1", words, column, shown="1/s")

    for i, (name, short, behind) in enumerate(
        (("ring and tool", "With the tool", ""), ("ring alone", "Alone", ", alone"))
    ):
        growth = curve(name, "as set", own[:, i])
        opened = bands_of(name, "1/s", others[:, :, i])
        each = [curve(f"{v}{behind}", "varied", f[:, i]) for v, f in values.items()]
        curves += [growth, *each]
        spread += opened
        title_of_one = f"Growth of {name}"
        panels += [
            Panel.of(title_of_one, growth, *opened, levels=(GROWS,), spans=shaded),
            Panel.of(f"{short}, {title}", *each, spans=shaded[-1:]),
        ]
    return Chart(
        Axis("speed", "rad/s", "rad/s"),
        speeds,
        tuple(curves),
        tuple(spread),
        panels=tuple(panels),
    )


def critical(deviations: Array, settings: Asked) -> Listing:
    """Return the speeds at which M_j is zero without hoop tension, and that tension."""
    j = np.arange(2.0, settings.harmonics + 1.0)
    rows = np.repeat(deviations[:1], len(j), axis=0)
    of, rings = values_of(rows, settings), build(rows, settings)
    Omega = j * np.sqrt(rings.nu)
    growth = ring_eigenvalues(rings, Omega, settings.hoop).real.max(axis=1)
    # where the eigenvalue is zero twice its growth is rounding
    growth = np.where(np.abs(growth) > NOTICED * Omega, growth, 0.0)
    stress = of["density"] * (Omega * of["radius"]) ** 2
    return Listing.of(
        "a harmonic, the speed at which its stiffness M_j is zero, the tension there",
        ("harmonic", "1", "count", j.astype(int)),
        ("speed", "rad/s", "rad/s", Omega),
        ("growth", "1/s", "1/s", growth),
        ("tension", "N", "kN", stress * of["width"] * of["thickness"]),
        ("hoop stress", "Pa", "MPa", stress),
    )


OFFERS = (
    Offer("spectrum", "frequencies and growth of the ring alone", spectrum, MACHINES),
    Offer("critical", "speeds at which a harmonic has no stiffness", critical),
    Offer("stability", "growth of ring and tool, and alone", stability, MACHINES),
)
