"""Mixtures of normal distributions: density, samples, fits to points."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array, Integers
from tolstat.deviations.rare_stage import chosen

ROUNDS = 15  # iterations of a fit, at most
EVEN = 0.8  # of the shares, split equally: small parts are sampled, too
POWERS = np.array([1.0, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.2, 0.1, 0.05])  # tried
EFFECTIVE, OF_PART = 150, 15  # effective sample sizes that suffice: in all, of a part
FEWEST, LEAST_OF_PART = 6, 2  # points that are fitted; of a part, or it is dropped
PRIOR = 4  # weight of the mean variance in each variance, in points
WIDER = 0.15  # least share of the study's variance in each: tails need room
LEAST_RISE = 1e-3  # of the mean logarithm of the density; below it a fit ends


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
        logs = np.empty((len(self.shares), len(points)))
        for i, (share, mean, root) in enumerate(zip(*self, strict=True)):
            away = points - mean
            if np.count_nonzero(root) == len(root):  # parts along the axes: fast
                away = away / np.diag(root)
            else:  # einsum, not BLAS: the same for any number of threads
                away = np.einsum("nj,ij->ni", away, np.linalg.inv(root))
            logs[i] = np.log(share) - 0.5 * np.einsum("ni,ni->n", away, away)
            logs[i] -= np.log(np.diag(root)).sum()
        logs -= 0.5 * points.shape[1] * np.log(2 * np.pi)
        return logs

    def log_density(self, points: Array) -> Array:
        """Return float64[point], the logarithm of the density at [point, direction]."""
        return np.asarray(np.logaddexp.reduce(self.log_parts(points)), np.float64)

    def parts(self, which: Array) -> Integers:
        """Return int64[point]: the part that each unit sample chooses."""
        return chosen(self.shares, which)

    def points(self, which: Array, scores: Array) -> Array:
        """Return float64[point, direction] points of the mixture.

        float64[point] unit samples choose parts; scores are float64[point, direction].
        """
        part = self.parts(which)
        points = np.empty_like(scores)
        for i in range(len(self.shares)):
            inside = part == i
            points[inside] = np.einsum("nj,ij->ni", scores[inside], self.roots[i])
        return points + self.means[part]

    def mixed(self, share: float, other: Mixture) -> Mixture:
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


def log_study(points: Array) -> Array:
    """Return float64[point], the logarithm of the density of the study: normal."""
    squares = np.einsum("ni,ni->n", points, points)
    return np.asarray(-0.5 * squares - 0.5 * points.shape[1] * np.log(2 * np.pi))


def fitted(points: Array, logs: Array, start: Mixture) -> Mixture:
    """Return a mixture fitted to weighted points, by expectation-maximisation.

    It begins with one part and with given parts. Cross-validation in two halves chooses
    between them.

    Parameters
    ----------
    points : float64[point, direction]
        Independent of each other.
    logs : float64[point]
        Logarithm of the weight of each. If few points dominate, powers of the weights
        below 1 are used: for each part the highest at which its effective sample size
        suffices.
    start : Mixture
        Parts to begin with; returned as they are where points are few.
    """
    if len(points) < FEWEST:
        return start
    halves = [(points[i::2], logs[i::2]) for i in (0, 1)]

    def suits(parts: Mixture) -> float:
        densities = [_even(_iterated(*half, parts)).log_density for half in halves]
        return sum(
            float(np.average(density(x), weights=tempered(log)[0]))
            for density, (x, log) in zip(densities, halves[::-1], strict=True)
        )

    best = max((centred(np.ones(1), points.shape[1]), start), key=suits)
    return _even(_iterated(points, logs, best))


def _even(mixture: Mixture) -> Mixture:
    n = len(mixture.shares)
    return mixture._replace(shares=(1 - EVEN) * mixture.shares + EVEN / n)


def tempered(logs: Array) -> tuple[Array, Array]:
    """Return float64[point] weights, and float64[power, point] their powers.

    The weights, of sum 1, have the highest power at which the effective sample size
    suffices.
    """
    table = np.exp(POWERS[:, None] * (logs - logs.max()))
    worth = table.sum(axis=1) ** 2 / np.square(table).sum(axis=1)
    power = int((worth >= min(worth.max() / 2, EFFECTIVE)).argmax())
    return table[power] / table[power].sum(), table


def _iterated(points: Array, logs: Array, start: Mixture) -> Mixture:
    """Return a fit with as many parts, or fewer."""
    weights, table = tempered(logs)
    mixture, last = start, -np.inf
    logs_of_parts = start.log_parts(points)
    for _ in range(ROUNDS):
        total = np.logaddexp.reduce(logs_of_parts)
        belongs = np.exp(logs_of_parts - total)
        powered = np.einsum("kn,pn->kpn", belongs, table)
        sums = powered.sum(axis=2)
        worths = sums**2 / np.maximum(np.square(powered).sum(axis=2), 1e-300)
        enough = np.minimum(OF_PART, worths.max(axis=1, keepdims=True) / 2)
        power = (worths >= enough).argmax(axis=1)
        parts_of_all = np.arange(len(power))
        worth = worths[parts_of_all, power]
        lasting = np.flatnonzero(worth >= min(LEAST_OF_PART, worth.max()))
        parts = [
            _part(points, powered[i, power[i]] / sums[i, power[i]], worth[i])
            for i in lasting
        ]
        means, roots = zip(*parts, strict=True)
        shares = np.maximum(np.einsum("kn,n->k", belongs[lasting], weights), 1e-6)
        mixture = Mixture(shares / shares.sum(), np.array(means), np.array(roots))
        logs_of_parts = mixture.log_parts(points)
        mean = float(np.average(np.logaddexp.reduce(logs_of_parts), weights=weights))
        if mean - last < LEAST_RISE:
            break
        last = mean
    return mixture


def _part(points: Array, weights: Array, worth: float) -> tuple[Array, Array]:
    """Return mean and triangle of the covariance of weighted points.

    `worth` is their effective sample size. Coordinates of the mean shrink by twice
    their variance (L. Breiman, Technometrics 37 (1995) 373-384), variances towards
    their mean.
    """
    mean = np.einsum("n,ni->i", weights, points)
    variances = np.einsum("n,ni->i", weights, (points - mean) ** 2)
    chance = np.maximum(variances, 0.2) / max(worth, 1.5)
    mean = mean * np.maximum(1 - 2 * chance / np.maximum(mean**2, 1e-300), 0.0)
    away = points - mean
    variances = np.einsum("n,ni->i", weights, away**2)
    variances = (worth * variances + PRIOR * variances.mean()) / (worth + PRIOR)
    spread = np.sqrt(roomy(variances))
    if len(mean) > worth:
        return mean, np.diag(spread)
    away = away / spread
    root = _root(np.einsum("ni,nj->ij", weights[:, None] * away, away), worth)
    return mean, spread[:, None] * root


def roomy(variances: Array) -> Array:
    """Return variances of which none is near zero: tails need room."""
    return np.maximum(variances, np.minimum((1 - WIDER) * variances + WIDER, 1.0))


def _root(correlations: Array, worth: float) -> Array:
    """Return the triangle of the correlations that an effective sample size supports.

    A direction keeps the spread if it differs by no more than chance (V. A. Marchenko,
    L. A. Pastur, Math. USSR Sbornik 1 (1967) 457-483). Otherwise hundreds of numbers
    would be fitted where few matter.
    """
    values, vectors = np.linalg.eigh(correlations)
    chance = np.sqrt(len(values) / worth)
    least, most = max(1 - chance, 0.0) ** 2, (1 + chance) ** 2
    values = np.where((values >= least) & (values <= most), 1.0, values)
    values = (1 - WIDER) * values + WIDER
    covariance = np.einsum("ik,jk->ij", vectors * values, vectors)
    return np.asarray(np.linalg.cholesky(covariance), np.float64)


AXES, SPECIAL = 15, 1.5  # principal axes tried at either end; ratio of variances
NARROWEST = 0.1  # common variance


def normal_of(halves: Sequence[Array]) -> Mixture:
    """Return a normal distribution, and a wider one about the same mean.

    They are fitted to two independent float64[trial, direction]. Coordinates of the
    mean shrink by twice their variance (L. Breiman, Technometrics 37 (1995) 373-384),
    which the distance of the two means tells. All directions share one variance. A
    principal axis of the first half has its own if its variance in the second half
    differs by more than the factor `SPECIAL`.
    """
    mean_1, mean_2 = (half.mean(axis=0) for half in halves)
    first, second = (half - half.mean(axis=0) for half in halves)
    n, d = len(first) + len(second), first.shape[1]
    chance = float(((mean_1 - mean_2) ** 2).sum()) / (4 * d)
    mean = (mean_1 + mean_2) / 2
    mean = mean * np.maximum(1 - 2 * chance / np.maximum(mean**2, 1e-300), 0.0)
    total = float((first**2).sum() + (second**2).sum()) / n + d * chance
    vectors = np.linalg.eigh(np.einsum("ni,nj->ij", first, first))[1].T
    axes = np.concatenate([vectors[:AXES], vectors[max(AXES, d - AXES) :]])
    variances = (np.einsum("ni,ai->na", second, axes) ** 2).mean(axis=0)
    ratio = variances * d / max(total, NARROWEST)
    axes = axes[(ratio > SPECIAL) | (ratio < 1 / SPECIAL)]
    away = np.concatenate([first, second])
    along = (np.einsum("ni,ai->na", away, axes) ** 2).mean(axis=0)
    common = np.array(max((total - along.sum()) / max(d - len(axes), 1), NARROWEST))
    more = roomy(along) - roomy(common)
    covariance = roomy(common) * np.eye(d) + np.einsum("a,ai,aj->ij", more, axes, axes)
    root = np.linalg.cholesky(covariance)
    wider = math.sqrt(1 + 1.5 / math.sqrt(d))
    return Mixture(
        np.array([0.6, 0.4]), np.array([mean, mean]), np.array([root, wider * root])
    )
