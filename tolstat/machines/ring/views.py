"""What a ring can show beside its histories: spectrum and stability over the speed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, replace
from typing import Any, NamedTuple

import numpy as np

from tolstat.arrays import Array
from tolstat.errors import ModelError
from tolstat.machines.ring.declarations import Asked
from tolstat.machines.ring.flutter import flutter_speed
from tolstat.machines.ring.linear import growth_rate, ring_eigenvalues, static_depth
from tolstat.machines.ring.parameters import Rings, build
from tolstat.model.view import (
    Axis,
    Band,
    Chart,
    Curve,
    Level,
    Offer,
    Panel,
    Span,
    bands_of,
)

MACHINES = 40  # with deviations, for bands
POINTS = 241  # of the range of speeds
SHOWN = 4  # frequencies, from the lowest on
GROWS = Level(0.0, "grows above")

OFFERS = (
    Offer("spectrum", "frequencies and growth of the ring alone over speed", MACHINES),
    Offer("stability", "growth of ring and tool, and of the ring alone", MACHINES),
)

# of (machines, their speeds): float64[speed, quantity]
Found = Callable[[Rings, Array], Array]


def own_and_others(
    deviations: Array, settings: Asked, speeds: Array, found: Found
) -> tuple[Array, Array]:
    """Return float64[speed, quantity] of the first machine, [machine, ...] of others.

    Others that cannot exist are left out.
    """
    exists = build(deviations, settings).exists
    own, *others = (
        found(build(np.repeat(row[None], len(speeds), axis=0), settings), speeds)
        for row in deviations[exists]
    )
    return own, np.array(others).reshape(-1, *own.shape)


class Varied(NamedTuple):
    """What is varied: settings by words for the value, and a title for its panels."""

    settings: dict[str, Asked]
    title: str  # it names values that no ring can have


def varied(settings: Asked) -> Varied:
    """Return the settings with each value of what is varied."""
    name, given = settings.varied, settings
    nominal = settings.nominal(name)
    if name == "radius":
        given = replace(settings, inner_radius=None)
    if nominal == 0.0:
        raise ModelError(f'varied = "{name}": its nominal value is 0, times what is 0')
    [kind] = [each.metadata["kind"] for each in fields(settings) if each.name == name]
    in_degrees = kind.unit == "rad"
    unit = {"rad": "deg", "1": ""}.get(kind.unit, kind.unit)
    found, cannot = {}, []
    for times in settings.varied_by:
        changed: Any = {name: nominal * times}
        shown = np.degrees(nominal * times) if in_degrees else nominal * times
        words = f"{name.replace('_', ' ')} {shown:.6g} {unit}".strip()
        if words in found:
            raise ModelError(f"varied_by has {words} twice")
        try:
            found[words] = replace(given, **changed)
        except ModelError:
            cannot.append(f"{shown:.6g} {unit}".strip())
    return Varied(found, f"{', '.join(cannot)} cannot be" if cannot else "varied")


def flutter(deviations: Array, settings: Asked) -> tuple[Span, ...]:
    """Return the shown speeds at which the first machine flutters."""
    if settings.hoop:
        return ()
    ring = build(deviations[:1], settings)
    onset = flutter_speed(ring.alpha, settings.support_angle, settings.harmonics)
    begins, (lower, upper) = float(onset[0] * np.sqrt(ring.nu[0])), settings.speed_range
    if begins >= upper:
        return ()
    return (Span(max(begins, lower), upper, "flutter without friction"),)


def spectrum(deviations: Array, settings: Asked) -> Chart:
    """Show frequencies and growth of the ring alone over the speed, Figs. 3 and 4.

    Returns
    -------
    Chart
        The lowest frequencies, the first with a band, and the growth with one; then
        the lowest frequency and the growth for each value of what is varied.
    """
    speeds = np.linspace(*settings.speed_range, POINTS)

    def found(rings: Rings, Omega: Array) -> Array:
        """Return the lowest frequencies, then the growth."""
        each = ring_eigenvalues(rings, Omega, settings.hoop)
        # each frequency stands twice, as +-i omega
        omega = np.abs(each.imag[:, ::2][:, :SHOWN])
        return np.column_stack([omega, each.real.max(axis=1)])

    own, others = own_and_others(deviations, settings, speeds, found)
    words = "natural frequency"
    names = [f"frequency {i + 1}" for i in range(own.shape[1] - 1)]
    curves = [
        Curve(name, "rad/s", f"omega_{i + 1}", words, own[:, i], shown="rad/s")
        for i, name in enumerate(names)
    ]
    growth = Curve("growth", "1/s", "tau_1", "of the ring alone", own[:, -1])
    lowest_band = bands_of(names[0], "rad/s", others[:, :, 0])
    grown = bands_of("growth", "1/s", others[:, :, -1])
    lowest, growths = [], []
    others_than = varied(settings)
    for value, other in others_than.settings.items():
        each, _ = own_and_others(deviations[:1], other, speeds, found)
        words = "lowest frequency"
        lowest.append(
            Curve(value, "rad/s", "omega_1", words, each[:, 0], shown="rad/s")
        )
        words = "of the ring alone"
        growths.append(Curve(f"growth, {value}", "1/s", "tau_1", words, each[:, -1]))
    shaded = flutter(deviations, settings)
    frequencies = (*names, *(band.name for band in lowest_band))
    return Chart(
        Axis("speed", "rad/s", "rad/s"),
        speeds,
        (*curves, growth, *lowest, *growths),
        (*lowest_band, *grown),
        panels=(
            Panel("Natural frequencies", frequencies, spans=shaded),
            Panel("Growth", ("growth", *(band.name for band in grown)), spans=shaded),
            Panel(
                f"Lowest frequency, {others_than.title}",
                tuple(each.name for each in lowest),
            ),
            Panel(f"Growth, {others_than.title}", tuple(each.name for each in growths)),
        ),
    )


def stability(deviations: Array, settings: Asked) -> Chart:
    """Show the growth of ring and tool, and of the ring alone, over the speed.

    Returns
    -------
    Chart
        Both with bands, then for each value of what is varied; a gap where there is no
        static depth, such as beyond 2 sqrt nu, where the ring does not rest.
    """
    lower, upper = settings.speed_range
    # a force at no speed has no size
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
    others_than, shaded = varied(settings), flutter(deviations, settings)
    values = {
        value: own_and_others(deviations[:1], other, speeds, found)[0]
        for value, other in others_than.settings.items()
    }
    curves: list[Curve] = []
    spread: list[Band] = []
    panels: list[Panel] = []

    def curve(name: str, words: str, column: Array) -> Curve:
        return Curve(name, "1/s", "tau_1", words, column, shown="1/s")

    for i, name in enumerate(("ring and tool", "ring alone")):
        set_ = curve(name, "as set", own[:, i])
        opened = bands_of(name, "1/s", others[:, :, i])
        each = [
            curve(value if i == 0 else f"{value}, alone", "varied", column[:, i])
            for value, column in values.items()
        ]
        curves += [set_, *each]
        spread += opened
        names = (name, *(band.name for band in opened))
        panels += [
            Panel(f"Growth of {name}", names, levels=(GROWS,), spans=shaded),
            Panel(
                f"{('With the tool', 'Alone')[i]}, {others_than.title}",
                tuple(one.name for one in each),
            ),
        ]
    return Chart(
        Axis("speed", "rad/s", "rad/s"),
        speeds,
        tuple(curves),
        tuple(spread),
        panels=tuple(panels),
    )
