"""Start-up laws: the speed of the programmed shaft, as printed and smoother.

phi0'' = eps0 f(s) over the start-up, eps0 = omega0/t0 (3), s = t/t0 from 0 to 1. The
mean of every f is 1, so that all laws reach omega0 at t0. The functions f are plain
NumPy of rows of lanes, too: the equations of motion call them.

References
----------
Yu. A. Semenov, N. S. Semenova, Transient processes in an elastic machine (2024, in
Russian); equation numbers are the paper's. It prints the constant acceleration alone;
the polynomial is drive law (1) of the stand (E. Ya. Antonyuk, A. G. Zabuga, 2012), the
thirds of the trapezoidal jerk are a choice made here.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array


def constant(s: Array) -> Array:
    """Constant acceleration, (4)."""
    return 1.0 + 0.0 * s


def polynomial(s: Array) -> Array:
    """Acceleration of 2 s^3 - 2 s^4 + 0.6 s^5; its end is smoother than its start."""
    return 12.0 * s * (1.0 - s) * (1.0 - s)


def trapezoidal(s: Array) -> Array:
    """Acceleration whose jerk is a trapezoid up and one down.

    It rises over a third of the start-up, is held over a third and falls over the last;
    in the rise the jerk itself rises, is held and falls, each over a third of that. The
    rate of the jerk jumps at each of these times.
    """
    near = np.minimum(s, 1.0 - s)  # the fall is the rise, read backwards
    second = np.maximum(near - 1.0 / 9.0, 0.0)
    third = np.maximum(near - 2.0 / 9.0, 0.0)
    held = np.maximum(near - 3.0 / 9.0, 0.0)
    rise: Array = near * near - second * second - third * third + held * held
    return 30.375 * rise


def cycloid(s: Array) -> Array:
    """Acceleration of a speed that grows along a cycloid, s - sin(2 pi s)/(2 pi)."""
    return 1.0 - np.cos(2.0 * np.pi * s)


def spectrum_of_constant(rho: Array) -> Array:
    """Return lambda = |sin pi rho|/(pi rho), as printed after (13)."""
    return np.abs(np.sinc(rho))


def spectrum_of_polynomial(rho: Array) -> Array:
    """Return lambda, by parts; below one turn, where powers cancel, by quadrature.

    By parts, from what f is at both ends: its first derivative 12 and 0, its second
    -48 and 24, its third 72.
    """
    x, weight = np.polynomial.legendre.leggauss(24)
    s = 0.5 + 0.5 * x
    slow = np.minimum(np.abs(rho), 1.0)
    wave = np.exp(-2j * np.pi * np.multiply.outer(slow, s))
    few_turns = (wave * (0.5 * weight * polynomial(s))).sum(axis=-1)
    ja = 2j * np.pi * np.maximum(np.abs(rho), 1.0)
    end = np.exp(-ja)
    by_parts = 12.0 / ja**2 - (48.0 + 24.0 * end) / ja**3 + 72.0 * (1.0 - end) / ja**4
    return np.abs(np.where(np.abs(rho) < 1.0, few_turns, by_parts))


def spectrum_of_trapezoidal(rho: Array) -> Array:
    """Return lambda: the law is three rectangles, 2/3, 2/9 and 1/9 long, folded."""
    three = np.sinc(rho * 2.0 / 3.0) * np.sinc(rho * 2.0 / 9.0) * np.sinc(rho / 9.0)
    return np.abs(three)


def spectrum_of_cycloid(rho: Array) -> Array:
    """Return lambda: that of 1, less half of each of its neighbours a turn away."""
    half = 0.5 * (np.sinc(rho - 1.0) + np.sinc(rho + 1.0))
    return np.abs(np.sinc(rho) + half)


class Law(NamedTuple):
    """A start-up law."""

    shape: Callable[[Array], Array]  # f(s) for s from 0 to 1
    # lambda(rho) >= 0, rho = omega t0/(2 pi): |integral of phi0'' e^(-j omega t)| =
    # |omega0| lambda, so eps0 t0 lambda as printed
    spectrum: Callable[[Array], Array]
    greatest: float  # of f
    knots: tuple[float, ...]  # where a derivative of f jumps: a step has to end there
    zeros: tuple[float, ...]  # the first zero of lambda, and their distance, if any
    sentence: str  # what the acceleration does


_NINTHS = tuple(i / 9.0 for i in (1, 2, 3, 6, 7, 8))
# in this order the equations of motion number them
LAWS = {
    "constant": Law(
        constant, spectrum_of_constant, 1.0, (), (1.0, 1.0), "constant acceleration"
    ),
    "polynomial": Law(
        polynomial, spectrum_of_polynomial, 16.0 / 9.0, (), (), "speed by a polynomial"
    ),
    "trapezoidal": Law(
        trapezoidal, spectrum_of_trapezoidal, 1.5, _NINTHS, (1.5, 1.5),
        "trapezoidal jerk",
    ),
    "cycloid": Law(
        cycloid, spectrum_of_cycloid, 2.0, (), (2.0, 1.0), "speed along a cycloid"
    ),
}  # fmt: skip
