"""Start-up laws: the speed of the programmed shaft, as printed and smoother.

phi0'' = eps0 f(s) over the start-up, eps0 = omega0/t0 (3), s = t/t0 from 0 to 1. The
mean of every f is 1, so that all laws reach omega0 at t0:

    constant     1, (4)
    polynomial   12 s (1 - s)^2, of a speed 2 s^3 - 2 s^4 + 0.6 s^5
    trapezoidal  its jerk is a trapezoid up and one down: it rises over a third, is held
                 and falls; in the rise the jerk rises, is held and falls by thirds
    cycloid      1 - cos 2 pi s, of a speed along a cycloid, s - sin(2 pi s)/(2 pi)

The paper prints the constant acceleration alone; the polynomial is drive law (1) of the
stand (E. Ya. Antonyuk, A. G. Zabuga, 2012), the thirds of the trapezoidal jerk are a
choice made here.
"""

from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple, TypeVar

import numpy as np
from numpy import sinc
from numpy.polynomial import Polynomial

from tolstat.arrays import Array

F = TypeVar("F", Array, Polynomial)


def polynomial(s: F) -> F:
    """Return f of the polynomial law at s, or as a polynomial of the polynomial s."""
    return 12.0 * s * (1.0 - s) * (1.0 - s)


# its derivatives by s behind the start
_F = polynomial(Polynomial((0.0, 1.0)))
_POLYNOMIAL = tuple(float(_F.deriv(order)(0.0)) for order in range(4))


def spectrum_of_polynomial(rho: Array) -> Array:
    """Return lambda, by parts; below one turn, where powers cancel, by quadrature.

    By parts, from the derivatives of f at both ends. At s = 1 f and f_ are 0.
    """
    x, weight = np.polynomial.legendre.leggauss(24)
    s = 0.5 + 0.5 * x
    slow = np.minimum(np.abs(rho), 1.0)
    wave = np.exp(-2j * np.pi * np.multiply.outer(slow, s))
    few_turns = (wave * (0.5 * weight * polynomial(s))).sum(axis=-1)
    ja = 2j * np.pi * np.maximum(np.abs(rho), 1.0)
    end = np.exp(-ja)
    _, f_, f__, f___ = _POLYNOMIAL
    jump = f__ - (f__ + f___) * end  # of the second derivative, at both ends
    by_parts = f_ / ja**2 + jump / ja**3 + f___ * (1.0 - end) / ja**4
    return np.abs(np.where(np.abs(rho) < 1.0, few_turns, by_parts))


class Law(NamedTuple):
    """A start-up law."""

    # lambda(rho) >= 0, rho = omega t0/(2 pi): |integral of phi0'' e^(-j omega t)| =
    # |omega0| lambda, so eps0 t0 lambda as printed
    spectrum: Callable[[Array], Array]
    greatest: float  # of f
    knots: tuple[float, ...]  # where a derivative of f jumps: a step has to end there
    zeros: tuple[float, ...]  # the first zero of lambda, and their distance, if any
    sentence: str  # what the acceleration does
    # f and its derivatives by s behind the start and behind each knot, up to the last
    # that is not zero; with a turn, the third is -turn^2 times the first
    pieces: tuple[tuple[float, ...], ...]
    turn: float = 0.0


def of_table(rows: Sequence[Mapping[str, float]]) -> Law:
    """Return the law of a table: straight lines, jumps where a time is repeated.

    s is the share of the table's last time T. f is the acceleration itself: the speed
    that multiplies it is T rad/s.
    """
    T = rows[-1]["time"]
    s = np.array([row["time"] for row in rows]) / T
    f = np.array([row["acceleration"] for row in rows])
    if s[0] > 0.0:
        s, f = np.append([0.0, s[0]], s), np.append([0.0, 0.0], f)
    lines = [
        (a, f_a, (f_b - f_a) / (b - a))
        for (a, f_a), (b, f_b) in pairwise(zip(s, f, strict=True))
        if b > a
    ]
    begins, values, slopes = (np.array(column) for column in zip(*lines, strict=True))
    ends = np.append(begins[1:], 1.0)

    def spectrum(rho: Array) -> Array:
        """By parts: of each line both ends, and its slope."""
        jw = 2j * np.pi * np.where(rho == 0.0, np.nan, rho)[..., None]
        last = values + slopes * (ends - begins)
        a, b = np.exp(-jw * begins), np.exp(-jw * ends)
        parts = (values * a - last * b) / jw + slopes * (a - b) / jw**2
        area = (0.5 * (values + last) * (ends - begins)).sum()
        share: Array = np.abs(np.where(rho == 0.0, area, parts.sum(axis=-1)))
        return share

    return Law(
        spectrum, float(f[np.argmax(np.abs(f))]), tuple(begins[1:].tolist()), (),
        "acceleration of the table",
        tuple(zip(values.tolist(), slopes.tolist(), strict=True)),
    )  # fmt: skip


_J = 6.75 * 9.0  # of the trapezoidal jerk, its rate
_NINTHS = tuple(i / 9.0 for i in (1, 2, 3, 6, 7, 8))
LAWS = {
    # as printed after (13): |sin pi rho|/(pi rho)
    "constant": Law(
        lambda rho: np.abs(sinc(rho)), 1.0, (), (1.0, 1.0), "constant acceleration",
        ((1.0,),),
    ),
    "polynomial": Law(
        spectrum_of_polynomial, 16.0 / 9.0, (), (), "speed by a polynomial",
        (_POLYNOMIAL,),
    ),
    # three rectangles, 2/3, 2/9 and 1/9 long, folded
    "trapezoidal": Law(
        lambda x: np.abs(sinc(x * 2.0 / 3.0) * sinc(x * 2.0 / 9.0) * sinc(x / 9.0)),
        1.5, _NINTHS, (1.5, 1.5), "trapezoidal jerk",
        (
            (0.0, 0.0, _J), (0.375, 6.75, 0.0), (1.125, 6.75, -_J), (1.5, 0.0, 0.0),
            (1.5, 0.0, -_J), (1.125, -6.75, 0.0), (0.375, -6.75, _J),
        ),
    ),
    # that of 1, less half of each of its neighbours a turn away
    "cycloid": Law(
        lambda rho: np.abs(sinc(rho) + 0.5 * (sinc(rho - 1.0) + sinc(rho + 1.0))),
        2.0, (), (2.0, 1.0), "speed along a cycloid",
        ((0.0, 0.0, 4.0 * np.pi**2),), 2.0 * np.pi,
    ),
}  # fmt: skip
