"""Mixtures of normal distributions: density, samples, fits to points."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.arrays import Array

MOST = 8  # parts of a fit
ROUNDS = 15  # iterations of a fit, at most
EVEN = 0.8  # of a fit in equal shares of its parts: small parts are sampled too
FEW, PLACES = 0.05, 25  # share of the points that a new part begins with; tried
WIDER = 0.15  # least share of `spread` in each variance: tails need room
LEAST_RISE = 1e-4  # of the mean logarithm of the density; below it a fit ends


class Mixture(NamedTuple):
    """Normal distributions, each with its share.

    Attributes
    ----------
    shares : float64[part]
        Their sum is 1.
    means : float64[part, direction]
        Mean of each part.
    roots : float64[part, direction, direction]
        Lower triangles L; the covariance is L L^T.
    """

    shares: Array
    means: Array
    roots: Array

    def log_parts(self, points: Array) -> Array:
        """Return float64[part, point], the logarithm of each part's density."""
        found = np.empty((len(self.shares), len(points)))
        for i, (share, mean, root) in enumerate(zip(*self, strict=True)):
            # einsum, not BLAS: the same for any number of threads
            away = np.einsum("nj,ij->ni", points - mean, np.linalg.inv(root))
            found[i] = np.log(share) - 0.5 * np.einsum("ni,ni->n", away, away)
            found[i] -= np.log(np.diag(root)).sum()
        found -= 0.5 * points.shape[1] * np.log(2 * np.pi)
        return found

    def log_density(self, points: Array) -> Array:
        """Return float64[point], the logarithm of the density at [point, direction]."""
        return np.asarray(np.logaddexp.reduce(self.log_parts(points)), np.float64)

    def parts(self, which: Array) -> NDArray[np.int64]:
        """Return int64[point]: the part that each unit sample chooses."""
        # the last part takes the remainder of rounding
        ends = np.cumsum(self.shares)[:-1]
        return np.asarray(np.searchsorted(ends, which, "right"), np.int64)

    def points(self, which: Array, scores: Array) -> Array:
        """Return float64[point, direction] points of the mixture.

        float64[point] unit samples choose parts; scores are float64[point, direction].
        """
        part = self.parts(which)
        found = np.empty_like(scores)
        for i in range(len(self.shares)):
            own = part == i
            found[own] = np.einsum("nj,ij->ni", scores[own], self.roots[i])
        return found + self.means[part]

    def beside(self, share: float, other: Mixture) -> Mixture:
        """Return a mixture of this one and another, which has a given share."""
        return Mixture(
            np.concatenate([(1 - share) * self.shares, share * other.shares]),
            np.concatenate([self.means, other.means]),
            np.concatenate([self.roots, other.roots]),
        )


def centred(spreads: Array, directions: int) -> Mixture:
    """Return isotropic normal distributions about zero, of equal shares."""
    n = len(spreads)
    roots = spreads[:, None, None] * np.eye(directions)
    return Mixture(np.full(n, 1 / n), np.zeros((n, directions)), roots)


def log_normal(squares: Array, spread: float, directions: int) -> Array:
    """Return the logarithm of the density of an isotropic normal distribution.

    Given squared distances from its mean, and its standard deviation.
    """
    logs = -0.5 * squares / spread**2 - directions * np.log(spread)
    return np.asarray(logs - 0.5 * directions * np.log(2 * np.pi), np.float64)


def fitted(points: Array, effective: float, spread: float) -> Mixture:
    """Return a mixture fitted to points, by expectation-maximisation.

    Parameters
    ----------
    points : float64[point, direction]
        Points may be repeated.
    effective : float
        Effective sample size of the points.
    spread : float
        Standard deviation in directions in which the points show no other.

    Returns
    -------
    Mixture
        With the number of parts that Schwarz's information criterion chooses.
    """
    everything = np.ones((1, len(points)))
    best, log_likelihood = _iterated(points, everything, effective, spread)
    # a covariance has few free numbers: most stay at the spread
    price = 0.5 * (1 + points.shape[1]) * np.log(effective) / effective
    while len(best.shares) < MOST:
        belongs = _one_more(points, best, spread)
        found, more = _iterated(points, belongs, effective, spread)
        if more - log_likelihood <= price:
            break
        best, log_likelihood = found, more
    n = len(best.shares)
    return best._replace(shares=(1 - EVEN) * best.shares + EVEN / n)


def _one_more(points: Array, mixture: Mixture, spread: float) -> Array:
    """Return float64[part, point] memberships with one more part.

    It begins at the best of several places, each the mean of neighbours (J. J. Verbeek,
    N. Vlassis, B. Krose, Neural Computation 15 (2003) 469-485). In many directions,
    points that are far from each other may be the ends of one cloud.
    """
    n, directions = points.shape
    few = max(round(FEW * n), 1)
    places = points[:: max(n // PLACES, 1)]
    squares = ((places[:, None, :] - points) ** 2).sum(axis=2)
    near = np.argpartition(squares, few, axis=1)[:, :few]
    means = points[near].mean(axis=1)
    squares = ((means[:, None, :] - points) ** 2).sum(axis=2)
    own = np.log(FEW) + log_normal(squares, spread, directions)
    log = np.log1p(-FEW) + mixture.log_density(points)
    most = np.logaddexp(log, own).sum(axis=1).argmax()
    best = centred(np.array([spread]), directions)._replace(means=means[[most]])
    each = mixture.beside(FEW, best).log_parts(points)
    return np.asarray(np.exp(each - np.logaddexp.reduce(each)), np.float64)


def _iterated(
    points: Array, belongs: Array, effective: float, spread: float
) -> tuple[Mixture, float]:
    """Return a fit with as many parts, and the mean logarithm of its density."""
    parts, (n, directions) = len(belongs), points.shape
    before = -np.inf
    for _ in range(ROUNDS):
        counts = np.maximum(belongs.sum(axis=1), 1e-3)
        means = np.einsum("kn,ni->ki", belongs, points) / counts[:, None]
        roots = np.empty((parts, directions, directions))
        for i in range(parts):
            away = points - means[i]
            scatter = np.einsum("ni,nj->ij", belongs[i][:, None] * away, away)
            own = effective * counts[i] / n
            roots[i] = _root(scatter / counts[i], own, spread)
        found = Mixture(counts / counts.sum(), means, roots)
        each = found.log_parts(points)
        total = np.asarray(np.logaddexp.reduce(each), np.float64)
        belongs, mean = np.exp(each - total), float(total.mean())
        if mean - before < LEAST_RISE:
            break
        before = mean
    return found, mean


def _root(scatter: Array, points: float, spread: float) -> Array:
    """Return the triangle of the covariance that a number of points supports.

    A direction keeps the spread if it differs by no more than chance (V. A. Marchenko,
    L. A. Pastur, Math. USSR Sbornik 1 (1967) 457-483). Otherwise hundreds of numbers
    would be fitted where few matter. No variance is near zero.
    """
    values, vectors = np.linalg.eigh(scatter)
    even = spread**2
    chance = np.sqrt(len(values) / max(points, 1e-3))
    least, most = even * max(1 - chance, 0.0) ** 2, even * (1 + chance) ** 2
    values = np.where((values >= least) & (values <= most), even, values)
    values = (1 - WIDER) * values + WIDER * even
    covariance = np.einsum("ik,jk->ij", vectors * values, vectors)
    return np.asarray(np.linalg.cholesky(covariance), np.float64)
