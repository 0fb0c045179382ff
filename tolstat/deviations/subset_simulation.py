"""Subset simulation: trials approach a limit in steps; moves that keep the study."""

import math

import numpy as np
from scipy.special import ndtr

from tolstat.arrays import Array, Integers
from tolstat.deviations.rare_stage import (
    RandomNumbers,
    Stages,
    better_shares,
    chosen,
    stage_of,
)
from tolstat.deviations.samplers import uniform

NEAREST = 0.25  # of the trials at a step: those nearest to the limit
STEPS = 16  # to the limit, at most
# Kinds of moves: how far along the slope and across it (0: not at all, 1: sampled
# again); share of the directions that change; 1: the distance across the slope stays.
MOVE_KINDS = np.array([
    (0.2, 0.2, 1, 0), (0.4, 0.4, 1, 0), (0.65, 0.65, 1, 0), (0.9, 0.9, 1, 0),
    (0.2, 0.5, 1, 0), (0.4, 0.8, 1, 0),
    (0.2, 0.98, 1, 0), (0.4, 0.98, 1, 0), (0.65, 0.98, 1, 0),
    (0.2, 0.5, 1, 1), (0.2, 0.98, 1, 1), (0.5, 0.98, 1, 1),
    (0.98, 0.98, 0.5, 0), (0.98, 0.98, 0.25, 0), (0.6, 0.6, 0.5, 0),
])  # fmt: skip
LEAST_SHARE = 0.03  # of each of these
OUTER = 0.05  # of the responses at either end: they do not tilt the slope
OUT = -float(np.nextafter(0, 1))  # the largest margin out of limit


def approach(numbers: RandomNumbers, trials: int) -> Stages[tuple[list[Array], int]]:
    """Yield stages that approach the limit step by step.

    The first trials are those of the study. Each step keeps the quarter nearest to the
    limit, copies it to the full number, and moves the copies. A move out of that
    quarter is rejected. This finds trials with many deviations that are a little
    extreme, which a greater spread rarely meets. A small kind of them may be lost. Two
    halves run independently, with `trials` in each step together.

    Returns
    -------
    tuple of (list of two float64[trial, direction], int)
        Trials out of limit of each half, none if the response does not lead there; the
        number of trials used.

    References
    ----------
    S.-K. Au, J. L. Beck, Estimation of small failure probabilities in high dimensions
    by subset simulation, Prob. Eng. Mech. 16 (2001) 263-277.
    """
    half = trials // 2
    points = numbers.scores(2 * half, "near 0")
    margins = yield stage_of(points)
    moves, used = Moves(numbers, points, margins), 2 * half
    before = float(margins.max())
    for step in range(1, STEPS):
        level = max(float(np.sort(margins)[int(NEAREST * len(margins))]), OUT)
        if level >= before > OUT:  # many are alike
            level = max(float(margins[margins < before].max(initial=-np.inf)), OUT)
            if margins.min() >= before:
                break  # the response is flat
        name = f"near {step}"
        parents = _parents(numbers, margins, level, name)
        points, margins = yield from moves.stage(
            points[parents], margins[parents], level, name
        )
        used += len(points)
        before = level
        if level == OUT:
            return [points[:half], points[half:]], used
    return [points[:0], points[:0]], used


def relaxed(
    numbers: RandomNumbers,
    points: Array,
    sweeps: int,
    evaluated: tuple[Array, Array],
    axes: Array,
) -> Stages[Array]:
    """Yield moves of out-of-limit trials; return them distributed as in the study.

    Parameters
    ----------
    numbers : RandomNumbers
        Those of the run.
    points : float64[point, direction]
        Out-of-limit trials in normal scores.
    sweeps : int
        Number of moves of each point.
    evaluated : tuple of (float64[trial, direction], float64[trial])
        Trials and their margins, which give the first slope.
    axes : float64[point, direction]
        Of length 1; every second sweep moves along and across these.
    """
    moves, margins = Moves(numbers, *evaluated), np.full(len(points), OUT)
    for sweep in range(sweeps):
        points, margins = yield from moves.stage(
            points, margins, OUT, f"relax {sweep}", axes if sweep % 2 else None
        )
    return points


class Moves:
    """Moves of Markov chains that keep the distribution of the study.

    The shares of the kinds of moves adapt to the distances of accepted moves. Long ones
    are accepted where the response hardly changes: across its slope, at the same
    distance from the median trial, or in few directions.

    References
    ----------
    T. Cui, K. J. H. Law, Y. M. Marzouk, Dimension-independent likelihood-informed MCMC,
    J. Comput. Phys. 304 (2016) 109-137. I. Papaioannou et al., MCMC algorithms for
    subset simulation, Prob. Eng. Mech. 41 (2015) 89-103.
    """

    def __init__(self, numbers: RandomNumbers, tried: Array, margins: Array) -> None:
        self.numbers = numbers
        self.tried, self.answers = tried, margins  # of the latest moves
        self.shares = np.full(len(MOVE_KINDS), 1 / len(MOVE_KINDS))

    def stage(
        self,
        points: Array,
        margins: Array,
        level: float,
        name: str,
        axes: Array | None = None,
    ) -> Stages[tuple[Array, Array]]:
        """Yield a stage of moves; return points and margins, moved within a level.

        Without axes, moves go along and across the slope of the response.
        """
        move = chosen(self.shares, self.numbers.unit("moves", len(points), name))
        scores = self.numbers.scores(len(points), name)
        other = self.numbers.scores(len(points), f"some {name}")
        if axes is None:
            axes = np.tile(slope(self.tried, self.answers), (len(points), 1))
        self.tried = moved(points, scores, axes, MOVE_KINDS[move], ndtr(other))
        self.answers = yield stage_of(self.tried)
        accepted = self.answers <= level
        gains = np.where(accepted, _distances(self.tried - points, axes), 0.0)
        self.shares = better_shares(move, gains, len(MOVE_KINDS), LEAST_SHARE)
        points = np.where(accepted[:, None], self.tried, points)
        return points, np.where(accepted, self.answers, margins)


def _parents(
    numbers: RandomNumbers, margins: Array, level: float, name: str
) -> Integers:
    """Return as many trials of each half within a level, each as often as another."""
    half, chosen = len(margins) // 2, []
    for first in (0, half):
        inside = np.flatnonzero(margins[first : first + half] <= level) + first
        if not len(inside):  # this half does not get there
            inside = np.flatnonzero(margins <= level)
        offset = uniform(numbers.seed, "parents", 1, f"{first} of {name}")[0]
        # not in a fixed place: the expected numbers are equal
        position = (np.arange(half) + offset) * (len(inside) / half)
        chosen.append(inside[np.minimum(position.astype(np.int64), len(inside) - 1)])
    return np.concatenate(chosen)


def moved(points: Array, scores: Array, axes: Array, kind: Array, u: Array) -> Array:
    """Return moved points: each move keeps the distribution of the study.

    `axes` are float64[point, direction] of length 1; float64[point, 4] tells how far,
    as in `MOVE_KINDS`; float64[point, direction] unit samples choose directions.
    """
    along, across, part, turned = kind.T[:, :, None]
    x, z = (np.einsum("ni,ni->n", rows, axes)[:, None] for rows in (points, scores))
    before = points - x * axes
    after = np.sqrt(1 - across**2) * before + across * (scores - z * axes)
    one_2, two_2 = (np.einsum("ni,ni->n", x, x)[:, None] for x in (before, after))
    same = np.sqrt(one_2 / np.maximum(two_2, 1e-300))
    turned_points = np.where(turned == 1, same * after, after)
    turned_points = turned_points + (np.sqrt(1 - along**2) * x + along * z) * axes
    new = np.sqrt(1 - across**2) * points + across * scores
    return np.where(part == 1, turned_points, np.where(u < part, new, points))


def slope(points: Array, margins: Array) -> Array:
    """Return float64[direction] of length 1, in which a response falls or rises."""
    finite = np.isfinite(margins)
    points, margins = points[finite], margins[finite]
    mean = points.mean(axis=0) if len(points) else np.ones(points.shape[1])
    away, falls = points - mean, np.zeros(points.shape[1])
    enough = len(points) >= 2 * points.shape[1]
    ends = np.quantile(margins, [OUTER, 1 - OUTER]) if enough else (0.0, 0.0)
    if ends[0] < ends[1]:
        margins = np.clip(margins, *ends)
        moments = np.einsum("ni,nj->ij", away, away)
        ridge = 1e-6 * np.trace(moments) * np.eye(len(mean))
        falls = np.linalg.solve(moments + ridge, np.einsum("ni,n->i", away, margins))
    direction = falls if falls.any() else mean
    return np.asarray(direction / math.sqrt(np.einsum("i,i->", direction, direction)))


def _distances(jump: Array, axes: Array) -> Array:
    """Return float64[point]: how far each moves, along and across alike on average."""
    along = np.einsum("ni,ni->n", jump, axes) ** 2
    across = np.einsum("ni,ni->n", jump, jump) - along
    scales = [max(float(squares.mean()), 1e-300) for squares in (along, across)]
    return np.asarray(along / scales[0] + across / scales[1])
