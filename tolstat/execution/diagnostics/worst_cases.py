"""Worst cases within the tolerances, searched among their corners."""

import itertools
from collections.abc import Callable, Generator, Sequence
from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array
from tolstat.execution.stages import Trials
from tolstat.execution.workers.block_scheduler import Workers
from tolstat.status import Status
from tolstat.store.run_records import WorstCase
from tolstat.study.study import Study

Move = tuple[list[int], int]  # columns, and the end they are moved to: 0 or 1
MOST_SWEEPS = 8
AT_ONCE = 1 << 24  # deviations of the trials that are simulated together, about
MOST_MOVED = 1 << 28  # deviations of all trials of a sweep, about


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


Search = Generator[Array, Array, Corner]


def worst_corners(
    respond: Callable[[Array], Array],
    ends: Array,
    groups: list[list[int]],
    targets: Sequence[Target],
) -> list[Corner]:
    """Return the worst trials found among the corners of the tolerances.

    The columns of a group change together. Each group is moved to either end of its
    tolerance (float64[2, contributor], SI). Moves that make a target worse are kept,
    all at once if that is worse still. The search is local and proves nothing.
    Of very many groups only `moved_at_most` are moved at once, by turns: first those
    whose worse end is least sure. `respond` returns the responses of trials. So many
    targets are searched at once that their trials take little memory.
    """
    most = moved_at_most(len(targets), len(groups), ends.shape[1])
    searches = (
        _screened(respond, ends, groups, targets, most)
        if most < len(groups)
        else [_search(target, ends, [groups]) for target in targets]
    )
    together = max(1, AT_ONCE // (2 * most * ends.shape[1]))
    return [
        corner
        for first in range(0, len(targets), together)
        for corner in _searched(respond, searches[first : first + together])
    ]


def moved_at_most(targets: int, groups: int, contributors: int) -> int:
    """Return how many groups a sweep moves for each target."""
    return min(groups, max(1, MOST_MOVED // (targets * contributors)))


def _screened(
    respond: Callable[[Array], Array],
    ends: Array,
    groups: list[list[int]],
    targets: Sequence[Target],
    number: int,
) -> list[Search]:
    """Return searches with one more start, that move so many groups at once.

    Each group is moved alone from the nominal trial, for all targets together. The
    start has the worse ends. Least sure is a group both of whose ends are worse than
    the nominal trial, or both better, or have no effect; then one with a small effect.
    """
    nominal = np.zeros(ends.shape[1])
    moves = [(columns, end) for columns in groups for end in (0, 1)]
    rows = np.vstack([nominal, _moved(nominal, moves, ends)])
    responses = respond(rows)
    searches = []
    for target in targets:
        badness = target.sign * responses[:, target.response]
        effects = np.nan_to_num(badness[1:] - badness[0], nan=-np.inf)
        low, high = effects.reshape(-1, 2).T
        corner = ends[0].copy()
        for columns in itertools.compress(groups, high > low):
            corner[columns] = ends[1, columns]
        least = np.minimum(np.abs(low), np.abs(high))
        unsure = np.where(np.sign(low) == np.sign(high), least, -least)
        order = np.argsort(-unsure, kind="stable")
        turns = [
            [groups[i] for i in np.sort(order[first : first + number])]
            for first in range(0, len(groups), number)
        ]
        widened = target._replace(starts=np.vstack([target.starts, corner]))
        screened, _ = _taken(target, Corner(np.nan, nominal, 0, 0), rows, responses)
        searches.append(_search(widened, ends, turns, screened))
    return searches


def _searched(
    respond: Callable[[Array], Array], searches: Sequence[Search]
) -> list[Corner]:
    """Return the worst trials of some searches, whose trials are simulated together."""
    pending = {number: next(search) for number, search in enumerate(searches)}
    corners: dict[int, Corner] = {}
    while pending:
        responses = respond(np.concatenate([*pending.values()]))
        parts = np.split(responses, np.cumsum([len(r) for r in pending.values()])[:-1])
        for number, responses in zip([*pending], parts, strict=True):
            try:
                pending[number] = searches[number].send(responses)
            except StopIteration as end:
                corners[number] = end.value
                del pending[number]
    return [corners[number] for number in range(len(searches))]


def _search(
    target: Target,
    ends: Array,
    turns: Sequence[list[list[int]]],
    corner: Corner | None = None,
) -> Search:
    """Search for one target: yield trials, receive their responses.

    Sweeps move the groups of each turn, one after the other, from the worst trial so
    far: `corner`, or the worst start. They end when a round of them improves nothing.
    """
    corner, rows = corner or Corner(np.nan, target.starts[0], 0, 0), target.starts
    corner, _ = _taken(target, corner, rows, (yield rows))
    idle = 0  # sweeps since the last one that improved
    for groups in itertools.islice(itertools.cycle(turns), MOST_SWEEPS):
        before = corner
        # a factor that is at that end already has no move
        differ = (before.deviations != ends).tolist()
        moves = ((columns, end) for columns in groups for end in (0, 1))
        tried = [(c, end) for c, end in moves if any(differ[end][i] for i in c)]
        if np.isnan(before.value) or not tried:
            break
        rows = _moved(before.deviations, tried, ends)
        corner, badness = _taken(target, before, rows, (yield rows))
        so_far = target.sign * before.value
        if not badness.max() > so_far + 1e-9 * abs(so_far):
            idle += 1
            if idle == len(turns):
                break
            continue
        idle = 0
        # all moves that made it worse, at once; of two ends the worse one
        taken: dict[int, Move] = {}  # by first column: one of both ends
        for i in np.lexsort((-np.arange(len(badness)), badness)):
            if badness[i] > so_far:
                taken[tried[i][0][0]] = tried[i]
        rows = before.deviations[None, :].copy()
        for columns, end in taken.values():
            rows[0, columns] = ends[end, columns]
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


def _moved(trial: Array, moves: Sequence[Move], ends: Array) -> Array:
    """Return the trial once a move, float64[move, contributor]."""
    rows = np.tile(trial, (len(moves), 1))
    sizes = [len(columns) for columns, _ in moves]
    columns = np.concatenate([columns for columns, _ in moves])
    end = np.repeat([end for _, end in moves], sizes)
    rows[np.repeat(np.arange(len(moves)), sizes), columns] = ends[end, columns]
    return rows


def worst_cases(
    study: Study, trials: Trials, ends: Array, slopes: Array, workers: Workers
) -> dict[str, dict[str, WorstCase]]:
    """Return the worst trials within the tolerances, for each end of each limit."""
    names = [contributor.name for contributor in study.description.contributors]
    responses = [response.name for response in study.description.responses]
    groups, ends_of_limits = _groups(study, ends), _ends_of_limits(study)
    if not groups or not ends_of_limits:
        return {}
    targets = []
    for name, sign in ends_of_limits:
        column = responses.index(name)
        starts = _worst_starts(sign * trials.responses[:, column], trials, ends)
        starts.append(_steepest(sign * slopes[:, column], ends, groups))
        targets.append(Target(column, sign, np.stack(starts)))
    corners = worst_corners(
        lambda rows: workers.simulate(study.model, rows, study.settings).responses,
        ends, groups, targets,
    )  # fmt: skip
    cases: dict[str, dict[str, WorstCase]] = {}
    for (name, sign), corner in zip(ends_of_limits, corners, strict=True):
        trial = dict(zip(names, corner.deviations.tolist(), strict=True))
        side = "largest" if sign > 0 else "least"
        cases.setdefault(name, {})[side] = WorstCase(
            corner.value, trial, corner.tried, corner.failed
        )
    return cases


def few_moved(study: Study, ends: Array) -> tuple[str, ...]:
    """Say that worst cases move but some of the contributors at once, if they do."""
    groups, targets = len(_groups(study, ends)), len(_ends_of_limits(study))
    if not groups or not targets:
        return ()
    most = moved_at_most(targets, groups, ends.shape[1])
    words = (
        f"a search for a worst case moves {most} of {groups} contributors at a time, "
        f"in {MOST_SWEEPS} sweeps: with fewer limits it sees more"
    )
    return (words,) if most < groups else ()


def _groups(study: Study, ends: Array) -> list[list[int]]:
    """Return the columns that change, together those of a batch of equal parts."""
    lower, upper = ends
    names = [contributor.name for contributor in study.description.contributors]
    batches = study.deviating.dependence.batches
    factors: dict[str, list[int]] = {}
    for column in np.flatnonzero(lower < upper).tolist():
        batch = batches.get(names[column])
        factor = batch.name if batch and batch.share == 1 else names[column]
        factors.setdefault(factor, []).append(column)
    return list(factors.values())


def _ends_of_limits(study: Study) -> list[tuple[str, int]]:
    """Return the response and the sign of each end of its limit."""
    return [
        (name, sign)
        for name, limit in study.limits.items()
        for sign, end in ((-1, limit.lower), (1, limit.upper))
        if np.isfinite(end)
    ]


def _worst_starts(badness: Array, trials: Trials, ends: Array) -> list[Array]:
    """Return the worst trial moved into the tolerances, and the worst inside them."""
    lower, upper = ends
    done = np.where(trials.status == Status.DONE, badness, -np.inf)
    starts = [np.clip(trials.deviations[done.argmax()], lower, upper)]
    within = ((trials.deviations >= lower) & (trials.deviations <= upper)).all(axis=1)
    inside = np.where(within, done, -np.inf)
    if inside.max() > -np.inf:
        starts.append(trials.deviations[inside.argmax()])
    return starts


def _steepest(slope: Array, ends: Array, groups: Sequence[list[int]]) -> Array:
    """Return the worst corner according to the slopes at the nominal trial."""
    lower, upper = ends
    change = np.nan_to_num(slope * (upper - lower), posinf=np.inf, neginf=-np.inf)
    corner: Array = lower.copy()
    for columns in groups:
        if change[columns].sum() > 0:
            corner[columns] = upper[columns]
    return corner
