"""Trials out of limit in many directions, and one normal distribution for them."""

import math
from collections.abc import Generator, Mapping

import numpy as np

from tolstat.arrays import Array, Integers, Truths
from tolstat.deviations.mixture import Mixture
from tolstat.deviations.rare_stage import RareStage, normal_scores, stage_of
from tolstat.deviations.samplers import uniform

KEPT = 0.25  # of the trials at a step: those nearest to the limit
STAGES, MOVED = 15, 5  # at most; moves of the trials out of limit
# of the spread: how far a trial is moved along the slope, and across it
FAR = np.array([
    (0.2, 0.2), (0.4, 0.4), (0.65, 0.65), (0.9, 0.9), (0.2, 0.5),
    (0.4, 0.8), (0.2, 0.98), (0.4, 0.98), (0.65, 0.98),
])  # fmt: skip
LEAST_SHARE = 0.04  # of each of these
OUTER = 0.05  # of the responses at either end: they do not tilt the slope
OUT = -float(np.nextafter(0, 1))  # the largest margin out of limit
WORTH = 0.05  # independent points per point: they descend from few
ALIKE = 0.4  # of the squared mean: how far the means of the halves may be apart
AXES, SPECIAL = 15, 1.5  # directions tried at either end; ratio of variances
WIDER = 0.15  # least share of the study's variance in each: tails need room


def approach(
    seed: int, streams: Mapping[str, int], trials: int
) -> Generator[RareStage, Array, tuple[Array, int]]:
    """Yield stages that approach the limit, far across the slope of the response.

    It is subset simulation in two independent halves. The response hardly changes
    across its slope. Trials move far there, so that those at the end, which descend
    from few, are nearly independent.

    Returns
    -------
    tuple of (float64[half, trial, direction], int)
        Trials out of limit, none if the response does not lead there; the number of
        trials used.

    References
    ----------
    T. Cui, K. J. H. Law, Y. M. Marzouk, Dimension-independent likelihood-informed MCMC,
    J. Comput. Phys. 304 (2016) 109-137. I. Papaioannou et al., MCMC algorithms for
    subset simulation, Prob. Eng. Mech. 41 (2015) 89-103.
    """
    half = trials // 2
    points = normal_scores(seed, streams, 2 * half, "many 0")
    margins = yield stage_of(points, 1.0, np.nan)
    tried, answers, used = points, margins, 2 * half
    shares, before = np.full(len(FAR), 1 / len(FAR)), float(margins.max())
    found: list[Array] = []
    for step in range(1, STAGES):
        level = max(float(np.sort(margins)[int(KEPT * len(margins))]), OUT)
        if level >= before > OUT:  # many are alike
            level = max(float(margins[margins < before].max(initial=-np.inf)), OUT)
            if margins.min() >= before:
                break  # the response is flat
        if len(found) == MOVED:
            break
        name = f"many {step}"
        parents = _parents(seed, margins, level, name)
        points, margins = points[parents], margins[parents]
        which = uniform(seed, "moves", len(points), f"of {name}")
        move = np.searchsorted(np.cumsum(shares)[:-1], which, "right")
        scores = normal_scores(seed, streams, len(points), name)
        axis = slope(tried, answers)
        tried = moved(points, scores, axis, FAR[move])
        answers = yield stage_of(tried, 1.0, np.nan)
        used += len(tried)
        kept = answers <= level
        shares = _better_shares(tried - points, axis, kept, move)
        points = np.where(kept[:, None], tried, points)
        margins, before = np.where(kept, answers, margins), level
        if level == OUT:
            found.append(points.reshape(2, half, -1))
    return np.concatenate([points[None, :0].repeat(2, 0), *found], axis=1), used


def _parents(seed: int, margins: Array, level: float, name: str) -> Array:
    """Return as many trials of each half within a level, each as often as another."""
    half, chosen = len(margins) // 2, []
    for first in (0, half):
        inside = np.flatnonzero(margins[first : first + half] <= level) + first
        if not len(inside):  # this half does not get there
            inside = np.flatnonzero(margins <= level)
        offset = uniform(seed, "parents", 1, f"{first} of {name}")[0]
        # not in a fixed place: the expected numbers are equal
        place = (np.arange(half) + offset) * (len(inside) / half)
        chosen.append(inside[np.minimum(place.astype(np.int64), len(inside) - 1)])
    return np.concatenate(chosen)


def moved(points: Array, scores: Array, axis: Array, far: Array) -> Array:
    """Return moved points: each move keeps the distribution of the study.

    float64[point, 2] tells how far: along the axis, and across it.
    """
    along, across = far.T[:, :, None]
    x, z = (np.einsum("ni,i->n", each, axis)[:, None] for each in (points, scores))
    new = np.sqrt(1 - across**2) * points + across * scores
    change = (np.sqrt(1 - along**2) - np.sqrt(1 - across**2)) * x
    return np.asarray(new + (change + (along - across) * z) * axis)


def slope(points: Array, margins: Array) -> Array:
    """Return float64[direction] of length 1, in which a response falls or rises."""
    sure = np.isfinite(margins)
    points, margins = points[sure], margins[sure]
    mean = points.mean(axis=0)
    away, falls = points - mean, np.zeros(points.shape[1])
    if len(points) >= 2 * points.shape[1]:
        margins = np.clip(margins, *np.quantile(margins, [OUTER, 1 - OUTER]))
        moments = np.einsum("ni,nj->ij", away, away)
        ridge = 1e-6 * np.trace(moments) * np.eye(len(mean))
        falls = np.linalg.solve(moments + ridge, np.einsum("ni,n->i", away, margins))
    found = falls if falls.any() else mean
    return np.asarray(found / math.sqrt(np.einsum("i,i->", found, found)))


def _better_shares(jump: Array, axis: Array, kept: Truths, move: Integers) -> Array:
    """Return shares of the moves, by how far each moves trials in all directions."""
    along = np.einsum("ni,i->n", jump, axis) ** 2
    across = (np.einsum("ni,ni->n", jump, jump) - along) / (len(axis) - 1)
    far = np.where(kept, along / along.mean() + across / across.mean(), 0.0)
    n = len(FAR)
    each = np.bincount(move, far, n) / np.maximum(np.bincount(move, minlength=n), 1)
    each = each / each.sum() if each.any() else np.full(n, 1 / n)
    return np.asarray(LEAST_SHARE + (1 - n * LEAST_SHARE) * each)


def one_region(halves: Array) -> bool:
    """Tell whether the independent halves found the same trials out of limit."""
    if not halves.size:
        return False
    one, other = halves.mean(axis=1)
    apart, middle = one - other, (one + other) / 2
    return bool((apart**2).sum() < ALIKE * (middle**2).sum())


def normal_of(halves: Array) -> Mixture:
    """Return a normal distribution fitted to float64[half, trial, direction].

    Coordinates of the mean shrink by twice their chance (L. Breiman, Technometrics 37
    (1995) 373-384). All directions have one variance, but those of the first half in
    which the second, too, has another one.
    """
    points = np.concatenate(halves)
    n, d = points.shape
    worth = WORTH * n
    mean = points.mean(axis=0)
    away = points - mean
    variances = np.einsum("ni,ni->i", away, away) / n * (worth / (worth - 1))
    chance = np.maximum(variances, 0.2) / worth
    mean = mean * np.maximum(1 - 2 * chance / np.maximum(mean**2, 1e-300), 0.0)
    first, second = away[: n // 2], away[n // 2 :]
    vectors = np.linalg.eigh(np.einsum("ni,nj->ij", first, first))[1].T
    axes = np.concatenate([vectors[:AXES], vectors[max(AXES, d - AXES) :]])
    own = (np.einsum("ni,ai->na", second, axes) ** 2).mean(axis=0)
    ratio = own / variances.mean()
    axes = axes[(ratio > SPECIAL) | (ratio < 1 / SPECIAL)]
    along = (np.einsum("ni,ai->na", away, axes) ** 2).mean(axis=0)
    common = max(float(variances.sum() - along.sum()) / max(d - len(axes), 1), 0.1)
    covariance = _roomy(common) * np.eye(d)
    more = _roomy(along) - _roomy(common)
    covariance += np.einsum("a,ai,aj->ij", more, axes, axes)
    root = np.linalg.cholesky(covariance)
    wider = math.sqrt(1 + 1.5 / math.sqrt(d))
    return Mixture(
        np.array([0.6, 0.4]), np.array([mean, mean]), np.array([root, wider * root])
    )


def _roomy(variance: Array | float) -> Array:
    least = (1 - WIDER) * np.asarray(variance) + WIDER
    return np.where(np.asarray(variance) < 1, least, variance)
