"""Rare-event sampling: trials out of limit are searched in stages, then weighted.

The search moves out-of-limit trials towards the median trial, to the most probable
points.
"""

from collections.abc import Generator, Mapping
from types import MappingProxyType

import numpy as np
from scipy.special import ndtr

from tolstat.arrays import Array, Integers
from tolstat.deviations.mixture import Mixture, centred
from tolstat.deviations.rare_search import (
    FOR_MOVES,
    FOR_STAGES,
    SPREADS,
    Search,
    in_equal_numbers,
)
from tolstat.deviations.rare_stage import (
    RandomNumbers,
    RareStage,
    Stages,
    better_shares,
    chosen,
    stage_of,
)
from tolstat.deviations.samplers import DISTANCE, SPREAD, STAGE, WEIGHT, Sampler
from tolstat.deviations.subset_simulation import approach

ROUNDS, IDLE = 40, 6  # at most; without any move
WAYS, LEAST_SHARE = 4, 0.1  # kinds of moves; least share of the trials for each
FACTORS = np.array([0.7, 0.85, 0.95])  # of all directions
PART_FACTORS = np.array([0.0, 0.5, 0.8])  # of a random part of the directions
HOW_MANY = np.array([0.5, 0.25])  # share of the directions in that part
NEIGHBOURS = 5  # nearest trials; a move goes half way to one of them
THINNING, LEAST_DISTANCE = 2, 2.0  # rounds between thinnings; of trials after one
MOST_POINTS = 128  # points that are used, at most
MOST_GAIN = 5.0  # of a round, in the logarithm of the squared distance


def likely_points(
    numbers: RandomNumbers, points: Array, trials: int
) -> Stages[tuple[Array, int]]:
    """Yield stages that move out-of-limit trials towards the median trial.

    A trial moves if its new place is nearer to the median, hence more probable, and out
    of limit, too. In subset simulation trials compete, and a kind of them may be lost.
    Here they do not: a trial is dropped only if one that is nearer to the median is
    within `LEAST_DISTANCE`.

    Parameters
    ----------
    numbers : RandomNumbers
        Those of the run.
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
        way = chosen(shares, numbers.unit("ways", len(points), name))
        choice = numbers.unit("factors", len(points), name)
        chance = ndtr(numbers.scores(len(points), name))
        tried = _nearer(points, way, choice, chance)
        margins = yield stage_of(tried)
        before, after = (np.einsum("ni,ni->n", x, x) for x in (points, tried))
        moved = (margins < 0) & (after < before)
        ratio = np.where(moved, before / np.maximum(after, 1e-300), 1.0)
        gains = np.minimum(np.log(ratio), MOST_GAIN)
        shares = better_shares(way, gains, WAYS, LEAST_SHARE)
        points = np.where(moved[:, None], tried, points)
        idle = 0 if moved.any() else idle + 1
        if step % THINNING == 0:
            points = separated(points)
    return separated(points), used


def _nearer(points: Array, way: Integers, choice: Array, chance: Array) -> Array:
    """Return float64[point, direction], each after a move of its kind.

    `choice` float64[point] and `chance` float64[point, direction] are unit samples.
    """
    n, directions = points.shape

    def one_of(values: Array) -> Array:
        return values[(choice * len(values)).astype(np.int64)][:, None]

    block = np.where(chance < one_of(HOW_MANY), one_of(PART_FACTORS), 1.0)
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
            uncovered &= ((points - point) ** 2).sum(axis=1) >= LEAST_DISTANCE**2
    return points[centres]


def study_around(points: Array) -> Mixture:
    """Return the study's distribution about each of the likeliest points."""
    means = points[:MOST_POINTS]
    return centred(np.ones(len(means)), means.shape[1])._replace(means=means)


LEAST_TRIALS, ENOUGH = 5000, 20_000  # least number of a run; a number that is enough
MANY, MANY_OF_KINDS = 16, 36  # directions that are many: of one kind, of several
# shares of the trials: of the first stage; of each step of subset simulation, and with
# many directions; at most, of the moves to likely points
FIRST_SHARE, STEP, STEP_OF_MANY, LED = 0.1, 0.01, 0.02, 0.25
LEAST_OF_STEP = 100  # trials
REACHED = 0.64  # points per start, below which the trials came together at points
LAST_SHARE = 0.1  # least share of the last stage
# shares of the trials that start to likely points, fewer to move more often; share of
# these that comes from subset simulation
STARTS, STARTS_OF_MANY, SURVIVORS = 0.02, 0.01, 1 / 8


class Rare(Sampler):
    """Importance sampling from a mixture that earlier stages have found.

    It works in the space of independent normal scores. The first stage, a tenth of the
    trials, has 1.5 to 4 times the spread of the study; in a few directions it reaches
    ten sigmas. `approach` follows the response towards the limit. `likely_points` moves
    the out-of-limit trials of both towards the median trial, to the most probable
    points of each kind.

    Each of five stages samples about these points, and from a mixture of normal
    distributions fitted to the weighted out-of-limit trials of the stages before. With
    16 directions or more, or 36 if there are several points, moves of Markov chains
    replace the five stages (`relaxed`). They distribute trials about the points as
    out-of-limit trials of the study; one mixture is fitted to these. If there are
    several points, or too few such trials, those of subset simulation are moved and
    fitted, too.

    The last stage samples from the last fit. A tenth comes from the study, nearly a
    twentieth from twice its spread. Only these weighted trials estimate the fraction;
    the tenth as in the study bounds the rest.

    A sample depends on the seed, the number of trials, the names and earlier responses.

    References
    ----------
    N. Kurtz, J. Song, Cross-entropy-based adaptive importance sampling using Gaussian
    mixture, Structural Safety 42 (2013) 35-44. J.-M. Cornuet et al., Adaptive multiple
    importance sampling, Scand. J. Statist. 39 (2012) 798-812. K. Breitung, The geometry
    of limit state function graphs and subset simulation: counterexamples, Reliability
    Engineering and System Safety 182 (2019) 98-106: why the response alone must not
    lead to the trials out of limit.
    """

    sample = False
    aims = True
    columns = MappingProxyType(
        {
            STAGE: "stage that the trial belongs to; NaN before it is drawn",
            SPREAD: "times the spread of the study that the stage aimed at",
            DISTANCE: "distance from the middle trial, in normal scores",
            WEIGHT: "density in the study over that in the stage; NaN where sought",
        }
    )
    promise = (
        "trials out of limit were sought in stages; the last stage, independent "
        "weighted trials, tells the fraction out of limit, with a gamma interval"
    )

    def unfit(self, trials: int, factors: int) -> str:
        """Return why a number of trials does not fit."""
        if not factors:
            return (
                "nothing deviates: no machine is rare; give a line in [deviations], "
                'such as rod_length = "+-1.2 mm", or a link its tolerance'
            )
        if trials < LEAST_TRIALS:
            return (
                f'sampling = "rare" needs {LEAST_TRIALS} trials or more: most of them '
                f"are to find trials out of limit; {ENOUGH} are plenty"
            )
        return ""

    def usual_trials(self, factors: int) -> int:
        """Return a number of trials that is enough for search and estimate."""
        return ENOUGH

    def warnings(self, trials: int, factors: int) -> tuple[str, ...]:
        """Return warnings that a number of trials may be too small."""
        if trials >= ENOUGH:
            return ()
        return (
            f"use trials = {ENOUGH} or more: with {trials} the search may miss a small "
            "kind of out-of-limit trials, and the interval does not include it",
        )

    def stages(
        self, seed: int, streams: Mapping[str, int], trials: int
    ) -> Generator[RareStage, Array, None]:
        """Yield stages; the arguments are as of `Sampler.stages`."""
        numbers, directions = RandomNumbers(seed, streams), len(streams)
        search = Search(numbers, trials)
        is_large = directions >= MANY
        yield from search.stage(centred(SPREADS, directions), FIRST_SHARE)
        step = max(round((STEP_OF_MANY if is_large else STEP) * trials), LEAST_OF_STEP)
        halves = yield from search.counted(approach(numbers, step))
        survivors, failures = np.concatenate(halves), search.out_of_limit
        number = round((STARTS_OF_MANY if is_large else STARTS) * trials)
        nearer = min(round(SURVIVORS * number), len(survivors))
        starts = [
            in_equal_numbers(failures, min(number - nearer, len(failures))),
            in_equal_numbers(survivors, nearer),
        ]
        # enough trials stay for the later stages
        after = round((LAST_SHARE + (FOR_MOVES if is_large else FOR_STAGES)) * trials)
        led = min(round(LED * trials), search.left - after)
        points = yield from search.counted(
            likely_points(numbers, np.concatenate(starts), led)
        )
        mixture = centred(np.ones(1), directions)  # if no response leads out of limit
        if len(points):
            centres = study_around(points)
            reached = len(points) < min(MOST_POINTS, REACHED * number)
            kinds = reached and len(points) > 1
            if directions >= (MANY_OF_KINDS if kinds else MANY):
                mixture = yield from search.at_once(centres, halves, reached=reached)
            else:
                mixture = yield from search.in_stages(centres, halves)
        yield from search.last_stage(mixture)
