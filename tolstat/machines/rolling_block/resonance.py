"""Speeds of the motor that resonate, and those that do not."""

from __future__ import annotations

import numpy as np

from tolstat.arrays import Array
from tolstat.machines.rolling_block.declarations import Settings
from tolstat.machines.rolling_block.gearbox import excitation_orders
from tolstat.units.grammar import Range


def named_orders(settings: Settings) -> dict[str, float]:
    """Return what excites the drive, in words, and how often per turn of the motor."""
    turns = excitation_orders(settings.combination)
    found = {f"order {_written(order)}": order for order in settings.orders}
    if settings.rolls:
        found["rolls 31, 32"] = turns["rolls_31"]
        found["rolls 33, 34"] = turns["rolls_34"]
    for mesh in settings.meshes:
        name = f"{mesh['teeth']} teeth, {mesh['shaft'].replace('_', ' ')}"
        found[name] = mesh["teeth"] * turns[mesh["shaft"]]
    return found


def _written(order: float) -> str:
    """Write an order so that no two are alike."""
    short = f"{order:g}"
    return short if float(short) == order else repr(order)


def forbidden(omega: Array, orders: list[float], band: float) -> tuple[Array, Array]:
    """Return the speeds at which an excitation is within the band of a frequency.

    Parameters
    ----------
    omega : float64[trial, mode]
        Natural frequencies, rad/s.
    orders : list of float
        Excitations per turn of the motor.
    band : float
        Share of the natural frequency.

    Returns
    -------
    lower, upper : float64[trial, order and mode]
        Speeds of the motor, rad/s; ends are forbidden too.
    """
    critical = np.concatenate([omega / order for order in orders], axis=1)
    return critical * (1.0 - band), critical * (1.0 + band)


def free_gaps(lower: Array, upper: Array, within: Range) -> tuple[Array, Array]:
    """Return the gaps between forbidden ranges, some of them empty.

    Parameters
    ----------
    lower, upper : float64[trial, range]
        Forbidden, rad/s.
    within : Range
        Speeds of the motor, rad/s.

    Returns
    -------
    begin, end : float64[trial, gap]
        Ascending, rad/s; a gap that ends before it begins is none.
    """
    rank = np.argsort(lower, axis=1)
    starts = np.take_along_axis(lower, rank, axis=1)
    reached = np.maximum.accumulate(np.take_along_axis(upper, rank, axis=1), axis=1)
    edge = np.full((len(lower), 1), within.lower)
    begin = np.concatenate([edge, np.maximum(reached, within.lower)], axis=1)
    end = np.concatenate(
        [np.minimum(starts, within.upper), np.full_like(edge, within.upper)], axis=1
    )
    return begin, end


def free_speeds(omega: Array, settings: Settings) -> tuple[Array, Array]:
    """Measure the speeds without resonance, of omega[trial, mode], rad/s.

    Returns
    -------
    total, widest : float64[trial]
        Width of all free ranges, and of the widest, rad/s; 0 where there are none.
    """
    orders = list(named_orders(settings).values())
    begin, end = free_gaps(
        *forbidden(omega, orders, settings.band), settings.speed_range
    )
    widths = np.maximum(end - begin, 0.0)
    total = np.zeros(len(omega))
    for width in widths.T:  # one by one: the sum is the same in any block
        total = total + width
    return total, np.max(widths, axis=1)


def speed_margin(omega: Array, settings: Settings) -> Array:
    """Return how far the working speed is from the nearest of omega[trial, mode].

    Returns
    -------
    float64[trial]
        min over orders and modes of |order n/60 - f_r| / f_r; 1: of the frequency.
    """
    nearest = np.full(len(omega), np.inf)
    for order in named_orders(settings).values():
        distance = np.abs(order * settings.working_speed - omega) / omega
        nearest = np.minimum(nearest, np.min(distance, axis=1))
    return nearest
