"""Sobol' indices of groups of trials, by a surface and by what it leaves.

A surface of each part of the groups is fitted to the other parts. Its variance is known
by its coefficients. Differences within groups estimate the shares of the remainder
alone, which is small where the response is smooth.
"""

from collections.abc import Iterator, Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.polynomial import hermite_e, legendre
from scipy.special import ndtr, ndtri

from tolstat.arrays import Array, Integers, Truths
from tolstat.statistics.intervals.as_sampled import PARTS

DEGREE, NORMAL_DEGREE = 8, 2  # of polynomials in a unit sample, in its normal score
# numbers of these, the more useful first: of factors like normal ones, and of others
NORMAL_FIRST = [9, 1, 10, *range(2, 9)]
UNIFORM_FIRST = [*range(1, 11)]
MOST_TERMS = 400  # beside the constant
TERMS_OF_GROUP = 0.4  # terms for each group, at most
# the surface of a part comes from the others, and theirs from it: where chance errors
# of surfaces count, the scatter between parts shows half of the variance
WIDER = 2**0.5
DIGITS = 12  # decimals of an index; the next ones are rounding errors of the fit


class Terms(NamedTuple):
    """Terms of a surface: products of two functions, of which number 0 is 1.

    Attributes
    ----------
    degrees : int
        Orthonormal functions of each factor.
    normal : bool[factor]
        Whether a factor is like a normal one.
    first, second : int64[term]
        Numbers of the functions; the constant comes first.
    counted : float64[2 factor, term but the constant]
        1 where a term belongs to the first order of a factor, then to its total.
    """

    degrees: int
    normal: Truths
    first: Integers
    second: Integers
    counted: Array

    @classmethod
    def of(cls, normal: Truths, most: int) -> "Terms":
        """Return the terms for these factors, so many at most."""
        factors = len(normal)
        degrees = min(DEGREE + NORMAL_DEGREE, most // max(factors, 1))
        single = 1 + np.arange(factors * degrees)
        pairs = np.zeros((2, 0), np.int64)
        for degree in range(degrees):  # of products
            larger = [
                (1 + i * degrees + a, 1 + j * degrees + b)
                for i, j in combinations(range(factors), 2)
                for a in range(degree + 1)
                for b in range(degree + 1 - a)
            ]
            if len(single) + len(larger) > most:
                break
            pairs = np.array(larger, np.int64).reshape(-1, 2).T
        first = np.concatenate([[0], single, pairs[0]])
        second = np.concatenate([np.zeros(1 + len(single), np.int64), pairs[1]])
        factor = [(number - 1) // max(degrees, 1) for number in (first, second)]
        of_factor = np.arange(factors)[:, None]
        involved = (factor[0] == of_factor) | (factor[1] == of_factor)
        counted = np.concatenate([involved & (second == 0), involved])[:, 1:]
        return cls(degrees, normal, first, second, counted.astype(np.float64))

    def values(self, unit: Array) -> Array:
        """Return float64[group * (2 + factor), term] of float64[group, 2, factor]."""
        groups, _, factors = unit.shape
        functions = np.where(
            self.normal[:, None],
            _orthonormal(unit, NORMAL_FIRST),
            _orthonormal(unit, UNIFORM_FIRST),
        )[..., : self.degrees]
        design = np.repeat(functions[:, :1], 2 + factors, axis=1)
        design[:, 1] = functions[:, 1]
        for factor in range(factors):
            design[:, 2 + factor, factor] = functions[:, 1, factor]
        design = design.reshape(groups * (2 + factors), -1)
        design = np.column_stack([np.ones(len(design)), design])
        return np.asarray(design[:, self.first] * design[:, self.second])


class GroupSurface:
    """Polynomials of the factors that follow responses of Saltelli's design.

    Parameters
    ----------
    unit : float64[group, 2, factor]
        Independent unit samples of trials A and B.
    normal : bool[factor]
        Whether a factor is like a normal one: see `like_normal`.

    References
    ----------
    A. B. Owen, Monte Carlo Theory, Methods and Examples, chapter 8: regression gives
    control variates. B. Sudret, Reliab. Eng. Syst. Saf. 93 (2008) 964-979: indices by
    coefficients of orthonormal polynomials.
    """

    def __init__(self, unit: Array, normal: Truths) -> None:
        most = min(MOST_TERMS, int(TERMS_OF_GROUP * len(unit)))
        self._terms = Terms.of(normal, most)
        self._unit = [unit[part::PARTS] for part in range(PARTS)]
        self._squares = np.array([values.T @ values for values in self._values()])

    def _values(self) -> Iterator[Array]:
        """Yield the terms in each part: again, as they need much memory."""
        return map(self._terms.values, self._unit)

    def indices(self, groups: Array) -> Array:
        """Estimate indices of a response: float64[1 + part, 2 factor].

        First orders, then totals: of all groups, then without each part.

        Parameters
        ----------
        groups : float64[group, 2 + factor]
            The response of trials A and B, and of A with one factor from B.
        """
        groups = groups - groups.mean()
        parts = [groups[part::PARTS] for part in range(PARTS)]
        products = np.array([
            values.T @ y.ravel()
            for values, y in zip(self._values(), parts, strict=True)
        ])  # fmt: skip
        # each part by the surface of the others: no, single or all terms
        squares = self._squares.sum(axis=0) - self._squares
        others = products.sum(axis=0) - products
        sizes = 1, int(np.count_nonzero(self._terms.second == 0)), len(others[0])
        surfaces = np.zeros((*others.shape, len(sizes)))
        for number, n in enumerate(sizes):
            surfaces[:, :n, number] = np.linalg.solve(
                squares[:, :n, :n], others[:, :n, None]
            )[..., 0]
        by_size = [
            y[..., None] - (values @ surface).reshape(*y.shape, -1)
            for values, y, surface in zip(self._values(), parts, surfaces, strict=True)
        ]
        best = int(sum(np.sum(x**2, axis=(0, 1)) for x in by_size).argmin())
        coefficients, remainders = surfaces[..., best], [x[..., best] for x in by_size]
        linked = _linked(np.concatenate(remainders))
        sums = np.array([
            len(y) * self._variances(surface, remainder, linked, product / y.size)
            for y, surface, remainder, product in zip(
                parts, coefficients, remainders,
                products - np.einsum("pij,pj->pi", self._squares, coefficients),
                strict=True,
            )
        ])  # fmt: skip
        table = np.vstack([sums.sum(axis=0), sums.sum(axis=0) - sums])
        shares = (table[:, :-1] / table[:, -1:]).round(DIGITS)
        shares[1:] = shares[0] + WIDER * (shares[1:] - shares[0])
        return np.asarray(shares)

    def _variances(
        self, surface: Array, remainder: Array, linked: Array, covariances: Array
    ) -> Array:
        """Return variances in a part: due to factors, and all: float64[2 factor + 1].

        Of the surface and of its remainder, and twice the covariances of its terms
        with that.

        References
        ----------
        G. Glen, K. Isaacs, Environ. Model. Softw. 37 (2012) 157-166: first orders
        without the chance correlation of A and B. M. J. W. Jansen, Comput. Phys.
        Commun. 117 (1999) 35-43: totals.
        """
        smooth = surface[1:] ** 2 + 2 * surface[1:] * covariances[1:]
        A, B, AB = remainder[:, :1], remainder[:, 1:2], remainder[:, 2:]
        first = np.mean(B * AB, axis=0) - linked * np.mean(A * B)
        total = np.mean((A - AB) ** 2, axis=0) / 2
        by_factor = self._terms.counted @ smooth + np.concatenate([first, total])
        return np.append(by_factor, smooth.sum() + np.mean(remainder**2))


def _linked(remainder: Array) -> Array:
    """Return the correlation of A with A with one factor from B: float64[factor]."""
    square = np.mean(remainder**2)
    if square == 0:
        return np.zeros(remainder.shape[1] - 2)
    changed = np.mean((remainder[:, :1] - remainder[:, 2:]) ** 2, axis=0) / 2
    return np.asarray(1 - (changed / square).clip(0, 1))


def _raw(unit: Array, score: Array) -> Array:
    """Return 1 and polynomials of unit samples and of their normal scores."""
    return np.concatenate([
        legendre.legvander(2 * unit - 1, DEGREE),
        hermite_e.hermevander(score, NORMAL_DEGREE)[..., 1:],
    ], axis=-1)  # fmt: skip


def _orthonormal(unit: Array, order: Sequence[int]) -> Array:
    """Return float64[..., function] of mean 0 and variance 1, uncorrelated."""
    score = np.linspace(-10, 10, 2001)  # the rule of trapezoids is exact to rounding
    density = np.exp(-(score**2) / 2)
    columns = [0, *order]
    raw = _raw(ndtr(score), score)[:, columns]
    triangle = np.linalg.qr(raw * np.sqrt(density / density.sum())[:, None], mode="r")
    functions = _raw(unit, ndtri(unit))[..., columns] @ np.linalg.inv(triangle)
    return np.asarray(functions[..., 1:])


def like_normal(values: Array, unit: Array) -> bool:
    """Return whether values follow the normal scores of unit samples more closely."""
    pairs = np.array([values, ndtri(unit), unit])
    with np.errstate(divide="ignore", invalid="ignore"):  # values that are all equal
        _, by_score, by_unit = np.corrcoef(pairs)[0]
    return bool(abs(by_score) > abs(by_unit))
