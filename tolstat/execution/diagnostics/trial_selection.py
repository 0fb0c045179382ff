"""Which trials are picked: at random, next to a limit, the worst, over the range."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.arrays import Array, Truths
from tolstat.deviations.samplers import uniform
from tolstat.execution.trial_table import Trials
from tolstat.statistics.limits.limit import Limit, margins
from tolstat.status import Status
from tolstat.store.run_records import Reason

Numbers = NDArray[np.int64]

EVERY = 100  # trials of which one is evaluated again
NEAREST = 4  # trials at least, on either side of each end of a limit
SPREAD = 12  # trials at least, over the range of a limited response
REACH = 2  # times the largest error seen: others may err more
IN_REACH = 20  # trials at least, that may be looked at because they may change sides
NO_LIMIT = Limit(-np.inf, np.inf)
WORST = 10  # trials of each limited response


class Choice(NamedTuple):
    """Trials to be evaluated again."""

    trials: Numbers  # int64[n]: their numbers, ascending
    # bool[n]: whether a trial is the one of its hundred that was chosen at random
    at_random: Truths
    # dict of str to uint8[n]: by response that chose trials on purpose: sums of
    # `Reason`, 0 for none
    chosen_by: Mapping[str, NDArray[np.uint8]]


def random_trials(seed: int, trials: int) -> Numbers:
    """Choose one trial at random of each hundred, whatever trials follow; ascending."""
    first = np.arange(0, trials, EVERY)
    # with a purpose: parts of a batch may be called so, too
    u = uniform(seed, "audit", len(first), "of trials")
    found: Numbers = first + (u * np.minimum(EVERY, trials - first)).astype(np.int64)
    return found


def choose(trials: Trials, limits: Mapping[str, Limit], seed: int) -> Choice:
    """Choose what is evaluated again, of trials that were drawn.

    One trial of each hundred at random; and of each limited response, on purpose, those
    next to its limit, the worst, and some over its range, where those chosen at random
    are too few to meet what is rare. In a study without limits the least and the
    largest of every response. The same whatever the workers: it depends on numbers
    of trials and on responses.
    """
    names = list(limits) or [each.name for each in trials.description.responses]
    # of another hundredth of the trials: with more of them the stretch about a limit
    # that is looked at keeps its width
    share = len(trials.deviations) // EVERY // len(names)
    purposes = {
        name: _on_purpose(
            trials.response(name), trials.status, limits.get(name, NO_LIMIT), share
        )
        for name in names
    }
    return _choice(random_trials(seed, len(trials.deviations)), purposes)


def choose_in_reach(
    trials: Trials,
    limits: Mapping[str, Limit],
    known: Choice,
    errors: Mapping[str, float],
) -> Choice:
    """Choose more trials, which may lie on the other side of a limit.

    Those that are nearer to a limit than twice the largest error that was seen (NaN if
    there is none). Of each response the nearest twenty, or its part of a hundredth of
    the trials, where they are more.
    """
    found: dict[str, dict[Reason, Numbers]] = {}
    for name, limit in limits.items():
        share = len(trials.deviations) // EVERY // len(limits)
        distance = np.abs(trials.response(name)[:, None] - limit.permitted).min(axis=1)
        distance[known.trials] = np.inf
        distance[trials.status != Status.DONE] = np.inf
        order = np.argsort(distance, kind="stable")[: max(IN_REACH, share)]
        found[name] = {Reason.NEAR: order[distance[order] <= REACH * errors[name]]}
    return _choice(np.zeros(0, np.int64), found)


def _choice(
    at_random: Numbers, purposes: Mapping[str, Mapping[Reason, Numbers]]
) -> Choice:
    own = [some for of in purposes.values() for some in of.values()]
    every = np.unique(np.concatenate([at_random, *own]))
    chosen_by = {name: np.zeros(len(every), np.uint8) for name in purposes}
    for name, of in purposes.items():
        for reason, some in of.items():
            chosen_by[name][np.searchsorted(every, some)] |= reason.value
    return Choice(every, np.isin(every, at_random), chosen_by)


def _on_purpose(
    values: Array, status: NDArray[np.uint8], limit: Limit, share: int
) -> dict[Reason, Numbers]:
    """Choose trials for the sake of one response."""
    done = np.flatnonzero(status == Status.DONE)
    known = values[done]
    ends = [end for end in limit.permitted if np.isfinite(end)]
    if not ends:
        return {Reason.SPREAD: done[spread(known, max(2, share // 2))]}
    number = max(NEAREST, share // 4 // len(ends))
    near = np.concatenate([next_to(known, limit, end, number) for end in ends])
    return {
        Reason.NEAR: done[near],
        Reason.WORST: np.array(worst_trials(values, status, limit), np.int64),
        Reason.SPREAD: done[spread(known, max(SPREAD, share // 2))],
    }


def next_to(values: Array, limit: Limit, end: float, number: int) -> Numbers:
    """Find the places of values next to an end of a limit, as many on either side."""
    distance = np.abs(values - end)
    within = values >= end if end == limit.lower else values <= end
    sides = [np.flatnonzero(side) for side in (within, ~within)]
    return np.concatenate(
        [side[np.argsort(distance[side], kind="stable")[:number]] for side in sides]
    )


def spread(values: Array, number: int) -> Numbers:
    """Choose values spread evenly from the least to the largest.

    By value and not by rank: a rare kind of trial that takes much of the range, as
    one that jams, is met as often as the many others. Places of these, ascending; fewer
    where many values are alike. No value is NaN.
    """
    if not len(values):
        return np.zeros(0, np.int64)
    order = np.argsort(values, kind="stable")
    ascending = values[order]
    middles = (ascending[1:] + ascending[:-1]) / 2
    wanted = np.linspace(ascending[0], ascending[-1], number)
    return np.unique(order[np.searchsorted(middles, wanted)])


def worst_trials(values: Array, status: NDArray[np.uint8], limit: Limit) -> list[int]:
    """Return the ten trials nearest to a limit, or farthest out; the worst first."""
    margin = margins(values, limit.permitted)
    margin[status != Status.DONE] = np.inf
    order: list[int] = np.argsort(margin, kind="stable")[:WORST].tolist()
    return [trial for trial in order if margin[trial] < np.inf]
