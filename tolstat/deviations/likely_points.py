"""Most probable points: out-of-limit trials, moved towards the median trial."""

from collections.abc import Generator, Mapping

import numpy as np
from scipy.special import ndtr

from tolstat.arrays import Array, Integers
from tolstat.deviations.mixture import Mixture, centred
from tolstat.deviations.rare_stage import (
    RareStage,
    better_shares,
    chosen,
    normal_scores,
    stage_of,
)
from tolstat.deviations.samplers import uniform

ROUNDS, IDLE = 40, 6  # at most; without any move
WAYS, LEAST_SHARE = 4, 0.1  # kinds of moves; least share of the trials for each
FACTORS = np.array([0.7, 0.85, 0.95])  # of all directions
SOME = np.array([0.0, 0.5, 0.8])  # of a random part of the directions
HOW_MANY = np.array([0.5, 0.25])  # share of the directions in that part
NEIGHBOURS = 5  # nearest trials; a move goes half way to one of them
EVERY, APART = 2, 2.0  # rounds between thinnings; distance of trials after them
MOST = 128  # points that are used, at most
MOST_GAIN = 5.0  # of a round, in the logarithm of the squared distance


def likely_points(
    seed: int, streams: Mapping[str, int], points: Array, trials: int
) -> Generator[RareStage, Array, tuple[Array, int]]:
    """Yield stages that move out-of-limit trials towards the median trial.

    A trial moves if its new place is nearer to the median, hence more probable, and out
    of limit, too. In subset simulation trials compete, and a kind of them may be lost.
    Here they do not: a trial is dropped only if one that is nearer to the median is
    within `APART`.

    Parameters
    ----------
    seed, streams
        As of `Sampler.stages`.
    points : float64[trial, direction]
        Out-of-limit trials to begin with, in normal scores.
    trials : int
        Number of trials that may be used, at most.

    Returns
    -------
    tuple of (float64[point, direction], int)
        Points that are apart, the likeliest first; the number of trials used.
    """
    used, idle, shares = 0, 0, np.full(WAYS, 1 / WAYS)
    for step in range(1, ROUNDS + 1):
        if not len(points) or idle == IDLE or used + len(points) > trials:
            break
        used += len(points)
        name = f"likely {step}"
        which = uniform(seed, "ways", len(points), f"of {name}")
        way = chosen(shares, which)
        choice = uniform(seed, "factors", len(points), f"of {name}")
        chance = ndtr(normal_scores(seed, streams, len(points), name))
        tried = _nearer(points, way, choice, chance)
        margins = yield stage_of(tried, 1.0, np.nan)
        before, after = (np.einsum("ni,ni->n", x, x) for x in (points, tried))
        moved = (margins < 0) & (after < before)
        ratio = np.where(moved, before / np.maximum(after, 1e-300), 1.0)
        gains = np.minimum(np.log(ratio), MOST_GAIN)
        shares = better_shares(way, gains, WAYS, LEAST_SHARE)
        points = np.where(moved[:, None], tried, points)
        idle = 0 if moved.any() else idle + 1
        if step % EVERY == 0:
            points = separated(points)
    return separated(points), used


def _nearer(points: Array, way: Integers, choice: Array, chance: Array) -> Array:
    """Return float64[point, direction], each after a move of its kind.

    `choice` float64[point] and `chance` float64[point, direction] are unit samples.
    """
    n, directions = points.shape

    def one_of(values: Array) -> Array:
        return values[(choice * len(values)).astype(np.int64)][:, None]

    block = np.where(chance < one_of(HOW_MANY), one_of(SOME), 1.0)
    rank = np.argsort(np.argsort(-np.abs(points), axis=1, kind="stable"), axis=1)
    largest = rank < np.round(directions**choice)[:, None]
    squares = np.einsum("ni,ni->n", points, points)
    between = squares[:, None] + squares - 2 * np.einsum("ni,mi->nm", points, points)
    np.fill_diagonal(between, np.inf)
    neighbours = np.argsort(between, axis=1, kind="stable")[:, : min(NEIGHBOURS, n)]
    neighbour = (choice * neighbours.shape[1]).astype(np.int64)
    half_way = (points + points[neighbours[np.arange(n), neighbour]]) / 2
    ways = block * points, one_of(FACTORS) * points, half_way, largest * points
    return np.asarray(np.select([way[:, None] == i for i in range(WAYS)], ways))


def separated(points: Array) -> Array:
    """Return points that are not beside one that is likelier, the likeliest first."""
    points = points[np.argsort(np.einsum("ni,ni->n", points, points), kind="stable")]
    uncovered, centres = np.ones(len(points), np.bool_), []
    for i, point in enumerate(points):
        if uncovered[i]:
            centres.append(i)
            uncovered &= ((points - point) ** 2).sum(axis=1) >= APART**2
    return points[centres]


def study_around(points: Array) -> Mixture:
    """Return the study's distribution about each of the likeliest points."""
    means = points[:MOST]
    return centred(np.ones(len(means)), means.shape[1])._replace(means=means)
