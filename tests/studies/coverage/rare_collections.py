"""Collections of rare failures with exact shares: Rackwitz's, the black-box ones.

R. Rackwitz, Reliability analysis: a review and some perspectives, Structural Safety 23
(2001) 365-395. M. Rozsas, A. Slobbe, Repository and black-box reliability challenge
2019, TNO: its numbers stand in the names (RP). All parts are standard normal; other
distributions are made from them. Shares are by quadrature, none is copied.
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.special import log_ndtr, ndtr
from scipy.stats import binom, chi2, gamma, norm, studentized_range
from scipy.stats import t as student_t


class NormalProblem(NamedTuple):
    """Number of parts, how far within its limit a trial is, share out of limit."""

    parts: int
    margin: object
    share: float


def exponential(x):
    """Return exponential parts, of mean 1, of standard normal ones."""
    return -log_ndtr(-x)


def integral(of, least=-9.0, most=9.0, pieces=72):
    """Integrate over a standard normal part, piece by piece."""
    ends = np.linspace(least, most, pieces + 1)
    return sum(
        quad(lambda y: norm.pdf(y) * of(y), a, b, epsabs=0, epsrel=1e-10)[0]
        for a, b in pairwise(ends)
    )


def plane(margin, end=8.5, columns=1201, rows=4001):
    """Share out of limit of two parts: sign changes in each column, then their sum."""
    at, grid = np.linspace(-end, end, columns), np.linspace(-end, end, rows)
    total = 0.0
    for x in at:

        def out(y, x=x):
            return margin(np.column_stack([np.full(len(y), x), y])) < 0

        state = out(grid)
        change = np.flatnonzero(state[1:] != state[:-1])
        low, high = grid[change], grid[change + 1]
        for _ in range(40):
            middle = (low + high) / 2
            same = out(middle) == state[change]
            low, high = np.where(same, middle, low), np.where(same, high, middle)
        ends = np.concatenate([[-np.inf], low, [np.inf]])
        first, last = ends[:-1], ends[1:]
        # by the tail that keeps its digits
        each = np.where(first < 0, ndtr(last) - ndtr(first), ndtr(-first) - ndtr(-last))
        inside = np.arange(len(each)) % 2 == (0 if state[0] else 1)
        total += norm.pdf(x) * each[inside].sum()
    return total * (at[1] - at[0])


def equal(parts, share):
    """The sum of equal parts."""
    end = np.sqrt(parts) * norm.isf(share)
    return NormalProblem(parts, lambda x: end - x.sum(axis=1), share)


def exponentials(parts, share, side):
    """The sum of exponential parts, too large or too small."""
    if side > 0:
        end = gamma.isf(share, parts)
        return NormalProblem(parts, lambda x: end - exponential(x).sum(axis=1), share)
    end = gamma.ppf(share, parts)
    return NormalProblem(parts, lambda x: exponential(x).sum(axis=1) - end, share)


def paraboloid(parts, bend, end):
    """One part against the squares of all others."""
    known = chi2(parts - 1)

    def margin(x):
        return end + bend * (x[:, 1:] ** 2).sum(axis=1) - x[:, 0]

    # over the quantiles of the sum of squares
    def at(s):
        return known.pdf(s) * norm.sf(end + bend * s)

    ends = np.linspace(0, known.isf(1e-15), 60)
    share = sum(quad(at, a, b, epsabs=0, epsrel=1e-10)[0] for a, b in pairwise(ends))
    return NormalProblem(parts, margin, share)


def quadratic(parts, share):
    """The sum of squares; no part and no direction matters more than others."""
    end = chi2.isf(share, parts)
    return NormalProblem(parts, lambda x: end - (x**2).sum(axis=1), share)


def pairs(count, share):
    """Both parts of any of several pairs out together."""
    each = -np.expm1(np.log1p(-share) / count)
    end = norm.isf(np.sqrt(each))

    def margin(x):
        both = x.reshape(len(x), count, 2).min(axis=2)
        return end - both.max(axis=1)

    return NormalProblem(2 * count, margin, share)


def some_of(needed, parts, share):
    """As many of the parts out at once, whichever."""
    p = brentq(
        lambda q: np.log(binom.sf(needed - 1, parts, np.exp(q)) / share),
        -20,
        0,
        xtol=1e-14,
    )
    end = norm.isf(np.exp(p))
    return NormalProblem(parts, lambda x: end - np.sort(x, axis=1)[:, -needed], share)


def kinds(parts, share, both=False):
    """Any part at its end, or at either end."""
    end = norm.isf(-np.expm1(np.log1p(-share) / parts) / (2 if both else 1))
    if both:
        return NormalProblem(parts, lambda x: end - np.abs(x).max(axis=1), share)
    return NormalProblem(parts, lambda x: end - x.max(axis=1), share)


def parallel(parts, share):
    """Sums of two halves out at once."""
    half = parts // 2
    end = norm.isf(np.sqrt(share)) * np.sqrt(half)

    def margin(x):
        return end - np.minimum(x[:, :half].sum(axis=1), x[:, half:].sum(axis=1))

    return NormalProblem(2 * half, margin, share)


def series(parts, count, share):
    """Any of several sums, each of other parts."""
    each = parts // count
    end = np.sqrt(each) * norm.isf(-np.expm1(np.log1p(-share) / count))

    def margin(x):
        return end - x.reshape(len(x), count, each).sum(axis=2).max(axis=1)

    return NormalProblem(count * each, margin, share)


def noisy(parts, noise, end):
    """A sum read with noise that repeats for the same trial, but follows no rule."""

    def margin(x):
        s = x.sum(axis=1) / np.sqrt(parts)
        u = np.modf(np.abs(np.sin(s * 12345.678 + x[:, 0] * 9876.54)) * 43758.5453)[0]
        return end - s + noise * (u - 0.5)

    share = quad(lambda u: norm.sf(end + noise * (u - 0.5)), 0, 1, epsrel=1e-11)[0]
    return NormalProblem(parts, margin, share)


def steps(parts, step, end):
    """A sum that is known in steps only."""

    def margin(x):
        s = x.sum(axis=1) / np.sqrt(parts)
        return end - step * np.floor(s / step) - 1e-9

    first = step * np.ceil(end / step - 1e-9)
    return NormalProblem(parts, margin, norm.sf(first))


def oscillating(parts, high, fast, end):
    """A part and a wave of another."""

    def margin(x):
        return end - x[:, 0] - high * np.sin(fast * x[:, 1])

    share = integral(lambda y: norm.sf(end - high * np.sin(fast * y)))
    return NormalProblem(parts, margin, share)


def of_plane(margin):
    """Return a problem of two parts."""
    return NormalProblem(2, margin, plane(margin))


def rp25():
    """Two curves at once."""

    def margin(x):
        a, b = x[:, 0], x[:, 1]
        return np.maximum(a**2 - 8 * b + 16, -16 * a + b**2 + 32)

    return of_plane(margin)


def rp22():
    """A parabola."""

    def margin(x):
        a, b = x[:, 0], x[:, 1]
        return 2.5 - (a + b) / np.sqrt(2) + 0.1 * (a - b) ** 2

    return of_plane(margin)


def rp31():
    """A steep valley."""
    return NormalProblem(
        2,
        lambda x: 2 - x[:, 1] + (4 * x[:, 0]) ** 4,
        integral(lambda y: norm.sf(2 + (4 * y) ** 4)),
    )


def rp57():
    """Two curves at once, or a circle."""

    def margin(x):
        a, b = x[:, 0], x[:, 1]
        one, two = -(a**2) + b**3 + 3, 2 - a - 8 * b
        return np.minimum(np.maximum(one, two), (a + 3) ** 2 + (b + 3) ** 2 - 4)

    return of_plane(margin)


def rp53():
    """A wave over a slope."""

    def margin(x):
        a, b = 1.5 + x[:, 0], 2.5 + x[:, 1]
        return np.sin(5 * a / 2) + 2 - (a**2 + 4) * (b - 1) / 20

    return of_plane(margin)


def rp28():
    """A product of two normal parts."""

    def margin(x):
        return (78064.0 + 11709.7 * x[:, 0]) * (0.0104 + 0.00156 * x[:, 1]) - 146.14

    return of_plane(margin)


def rp8():
    """Six lognormal parts, those of the challenge."""
    mean = np.array([120.0, 120, 120, 120, 50, 40])
    sd = np.array([12.0, 12, 12, 12, 10, 8])
    s = np.sqrt(np.log1p((sd / mean) ** 2))
    m = np.log(mean) - s**2 / 2
    c = np.array([1.0, 2, 2, 1, -5, -5])
    h, n = 0.02, 2**17
    at = h * (np.arange(n) - n // 2)
    edges = np.append(at - h / 2, at[-1] + h / 2)
    out = np.ones(n // 2 + 1, complex)
    for mi, si, ci in zip(m, s, c, strict=True):
        z = np.maximum(np.sign(ci) * edges / abs(ci), 1e-300)
        p = np.diff(norm.cdf((np.log(z) - mi) / si))
        out = out * np.fft.rfft(np.fft.ifftshift(np.abs(p)))
    total = np.fft.fftshift(np.fft.irfft(out, n))
    share = float(total[at < -h / 4].sum() + 0.5 * total[np.abs(at) < h / 4].sum())
    return NormalProblem(6, lambda x: np.exp(m + s * x) @ c, share)


def bridge(share):
    """Three kinds of unlike size among fifteen parts; one needs four parts."""
    a, b = norm.isf(0.6 * share), np.sqrt(3) * norm.isf(0.3 * share)
    c = norm.isf((0.1 * share) ** 0.25)

    def margin(x):
        return np.minimum(
            np.minimum(a - x[:, 0], b - x[:, 1:4].sum(axis=1)),
            c - x[:, 4:8].min(axis=1),
        )

    share = 1 - (1 - 0.6 * share) * (1 - 0.3 * share) * (1 - 0.1 * share)
    return NormalProblem(15, margin, share)


def ranges(parts, share):
    """The range of equal parts: many directions alike."""
    end = brentq(lambda e: np.log(studentized_range.sf(e, parts, np.inf) / share), 3, 9)
    return NormalProblem(parts, lambda x: end - np.ptp(x, axis=1), share)


def two_limits(parts, share):
    """A part, or the sum of all others: a kind of three in four."""
    a = norm.isf(0.75 * share)
    b = np.sqrt(parts - 1) * norm.isf(0.25 * share)
    total = 1 - (1 - 0.75 * share) * (1 - 0.25 * share)

    def margin(x):
        return np.minimum(a - x[:, 0], b - x[:, 1:].sum(axis=1))

    return NormalProblem(parts, margin, total)


def middle(parts, share):
    """Too near to the middle in all parts at once: no part is off."""
    end = chi2.ppf(share, parts)
    return NormalProblem(parts, lambda x: (x**2).sum(axis=1) - end, share)


def student(parts, share):
    """A part over the scatter of the others: the quotient is off, hardly a part."""
    end = student_t.isf(share, parts - 1)

    def margin(x):
        return end - x[:, 0] / np.sqrt((x[:, 1:] ** 2).mean(axis=1))

    return NormalProblem(parts, margin, share)


COLLECTED = {
    "hundred equal, 1e-6": lambda: equal(100, 1e-6),
    "hundred equal, 1e-4": lambda: equal(100, 1e-4),
    "forty equal, 1e-7": lambda: equal(40, 1e-7),
    "twenty exponential, too large, 1e-5": lambda: exponentials(20, 1e-5, 1),
    "hundred exponential, too large, 1e-6": lambda: exponentials(100, 1e-6, 1),
    "fifty exponential, too small, 1e-6": lambda: exponentials(50, 1e-6, -1),
    "paraboloid of ten": lambda: paraboloid(10, 0.1, 4.0),
    "paraboloid of a hundred": lambda: paraboloid(100, 0.01, 4.0),
    "paraboloid of a hundred, inward": lambda: paraboloid(100, -0.01, 6.0),
    "quadratic of ten, 1e-6": lambda: quadratic(10, 1e-6),
    "quadratic of a hundred, 1e-6": lambda: quadratic(100, 1e-6),
    "six pairs, 1e-6": lambda: pairs(6, 1e-6),
    "three of six, 1e-6": lambda: some_of(3, 6, 1e-6),
    "thirty kinds, 1e-6": lambda: kinds(30, 1e-6),
    "parallel of ten, 1e-6": lambda: parallel(10, 1e-6),
    "series of twenty, 1e-6": lambda: series(20, 4, 1e-6),
    "noisy, 1e-5": lambda: noisy(5, 0.6, 4.2),
    "noisy of fifty, 1e-5": lambda: noisy(50, 0.6, 4.2),
    "steps, 3e-5": lambda: steps(3, 0.5, 4.0),
    "oscillating": lambda: oscillating(2, 0.5, 6.0, 4.5),
    "RP22": rp22,
    # not looked at before the method was fixed
    "RP8": rp8,
    "RP25": rp25,
    "RP28": rp28,
    "RP31": rp31,
    "RP53": rp53,
    "RP57": rp57,
    "RP54 (twenty exponential, too small)": lambda: exponentials(20, 9.98e-4, -1),
    "RP63 (paraboloid of a hundred)": lambda: paraboloid(100, 0.1, -4.5),
    "RP107 (ten equal)": lambda: equal(10, norm.sf(5)),
    "three kinds of fifteen, 1e-6": lambda: bridge(1e-6),
    "sixteen ends of eight, 1e-5": lambda: kinds(8, 1e-5, True),
    "two of eight, 1e-5": lambda: some_of(2, 8, 1e-5),
    "steps of sixty, 3e-5": lambda: steps(60, 0.5, 4.0),
    "oscillating of twelve": lambda: oscillating(12, 1.0, 3.0, 5.0),
    "range of six, 1e-6": lambda: ranges(6, 1e-6),
    "parallel of sixty, 1e-4": lambda: parallel(60, 1e-4),
    # kept back while it was changed for many kinds and directions
    "two of five, 1e-6": lambda: some_of(2, 5, 1e-6),
    "ten exponential, too large, 1e-6": lambda: exponentials(10, 1e-6, 1),
    "ten exponential, too small, 1e-6": lambda: exponentials(10, 1e-6, -1),
    "forty exponential, too large, 1e-5": lambda: exponentials(40, 1e-5, 1),
    "parallel of twenty, 1e-5": lambda: parallel(20, 1e-5),
    "quadratic of forty, 1e-4": lambda: quadratic(40, 1e-4),
    "middle of sixty, 1e-5": lambda: middle(60, 1e-5),
    "student of twelve, 1e-5": lambda: student(12, 1e-5),
    "two limits of twenty, 1e-6": lambda: two_limits(20, 1e-6),
}
