"""Tolerance analysis without sampling: slopes, and the worst case."""

from collections.abc import Generator, Sequence
from typing import Any, NamedTuple

import numpy as np

from tolstat.arrays import Array, Truths
from tolstat.deviations.spread import spread_of
from tolstat.execution.workers.block_scheduler import Workers
from tolstat.model.contract import Model
from tolstat.study.study import Study

Move = tuple[list[int], Array]  # columns, and the ends they are moved to
STEP = 0.1  # of a usual deviation, to either side
MOST_SWEEPS = 8


def slopes(
    model: Model,
    settings: Any,
    usual: Array,
    workers: Workers,
    trial: Array | None = None,
) -> Array:
    """Return the slopes of the responses at one trial.

    Parameters
    ----------
    model : Model
        The model.
    settings : object
        Its settings.
    usual : float64[contributor]
        Usual size of each deviation, SI; a contributor with zero has no slope.
    workers : Workers
        Evaluate the trials.
    trial : float64[contributor], optional
        Deviations of the trial, SI; the nominal one if not given.

    Returns
    -------
    float64[contributor, response]
        By central differences over a tenth of `usual` to either side;
        NaN where a trial failed.
    """
    varying = np.flatnonzero(usual > 0)
    if not len(varying):
        return np.zeros((len(usual), len(model.describe(settings).responses)))
    step = STEP * usual[varying]
    ahead = np.diag(STEP * usual)[varying]
    shifted = np.concatenate([ahead, -ahead]) + (0.0 if trial is None else trial)
    responses = workers.simulate(model, shifted, settings).responses
    ahead, behind = np.split(responses, 2)
    table = np.zeros((len(usual), responses.shape[1]))
    table[varying] = (ahead - behind) / (2 * step[:, None])
    return table


def tolerance_ends(study: Study) -> tuple[Array, Array]:
    """Return both ends of each contributor's tolerance, SI; zero without tolerance."""
    names = [contributor.name for contributor in study.description.contributors]
    ends = np.zeros((2, len(names)))
    for name, distribution in study.deviating.distributions.items():
        ends[:, names.index(name)] = spread_of(distribution)[:2]
    return ends[0], ends[1]


def slopes_by_name(
    study: Study, table: Array, varying: Truths
) -> dict[str, dict[str, float]]:
    """Return slopes by response and contributor that deviates."""
    if not varying.any():
        return {}
    names = [contributor.name for contributor in study.description.contributors]
    return {
        response.name: {names[i]: float(slope[i]) for i in np.flatnonzero(varying)}
        for response, slope in zip(study.description.responses, table.T, strict=True)
    }


class Target(NamedTuple):
    """A response, and the direction in which it gets worse."""

    response: int  # its column
    sign: int  # 1 for the largest value, -1 for the least
    # float64[start, contributor]: the search starts at the worst of these trials
    starts: Array


class Corner(NamedTuple):
    """The worst trial found; usually a corner of the tolerances."""

    value: float  # of the response, SI; NaN if every trial failed
    deviations: Array  # float64[contributor], SI
    # trials simulated for it, and how many of these failed
    tried: int
    failed: int


def worst_corners(
    model: Model,
    settings: Any,
    lower: Array,
    upper: Array,
    factors: Sequence[Sequence[int]],
    targets: Sequence[Target],
    workers: Workers,
) -> list[Corner]:
    """Return the worst trials found among the corners of the tolerances.

    A factor is a group of columns that change together. Each is moved to either end of
    its tolerance (float64[contributor], SI). Moves that make a target worse are kept,
    all at once if that is worse still. The search is local and proves nothing.
    """
    searches = [_search(target, lower, upper, factors) for target in targets]
    pending = {number: next(search) for number, search in enumerate(searches)}
    corners: dict[int, Corner] = {}
    while pending:
        answers = workers.simulate(model, np.concatenate([*pending.values()]), settings)
        ends = np.cumsum([len(rows) for rows in pending.values()])[:-1]
        parts = np.split(answers.responses, ends)
        for number, responses in zip([*pending], parts, strict=True):
            try:
                pending[number] = searches[number].send(responses)
            except StopIteration as end:
                corners[number] = end.value
                del pending[number]
    return [corners[number] for number in range(len(targets))]


def _search(
    target: Target, lower: Array, upper: Array, factors: Sequence[Sequence[int]]
) -> Generator[Array, Array, Corner]:
    """Search for one target: yield trials, receive their responses."""
    moves = [
        (list(columns), end[list(columns)])
        for columns in factors
        for end in (lower, upper)
    ]
    corner, rows = Corner(np.nan, target.starts[0], 0, 0), target.starts
    corner, _ = _taken(target, corner, rows, (yield rows))
    for _ in range(MOST_SWEEPS):
        before = corner
        # a factor that is at that end already has no move
        tried = [(c, end) for c, end in moves if np.any(before.deviations[c] != end)]
        if np.isnan(before.value) or not tried:
            break
        rows = np.array([_moved(before.deviations, [move]) for move in tried])
        corner, badness = _taken(target, before, rows, (yield rows))
        so_far = target.sign * before.value
        if not badness.max() > so_far + 1e-9 * abs(so_far):
            break
        # all moves that made it worse, at once; of two ends the worse one
        taken: dict[int, Move] = {}  # by first column: one of both ends
        for i in np.lexsort((-np.arange(len(badness)), badness)):
            if badness[i] > so_far:
                taken[tried[i][0][0]] = tried[i]
        rows = _moved(before.deviations, list(taken.values()))[None, :]
        corner, _ = _taken(target, corner, rows, (yield rows))
    return corner


def _taken(
    target: Target, best: Corner, rows: Array, responses: Array
) -> tuple[Corner, Array]:
    """Return the worst trial so far, and how bad each row is."""
    values = responses[:, target.response]
    badness = np.where(np.isnan(values), -np.inf, target.sign * values)
    most, failed = int(badness.argmax()), int(np.isnan(values).sum())
    value, trial = best.value, best.deviations
    if badness[most] > (-np.inf if np.isnan(value) else target.sign * value):
        value, trial = float(values[most]), rows[most]
    corner = Corner(value, trial, best.tried + len(values), best.failed + failed)
    return corner, badness


def _moved(trial: Array, moves: Sequence[Move]) -> Array:
    """Return a trial with some of its parts at an end of their tolerance."""
    moved = trial.copy()
    for columns, ends in moves:
        moved[columns] = ends
    return moved
