"""The trials that an audit evaluates again.

They are chosen at random, next to a limit, among the worst and those out of limit, and
over the range.
"""

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.arrays import Array, Integers, Truths
from tolstat.deviations.samplers import uniform
from tolstat.execution.stages import Trials
from tolstat.statistics.intervals.shares import anytime_valid
from tolstat.statistics.limits.limit import NO_LIMIT, Limit, within, worst_trials
from tolstat.status import Status
from tolstat.store.run_records import Audited, Reason

EVERY = 100  # one of so many trials is evaluated again
NEAREST = 4  # trials at least, on either side of each end of a limit
FAILED = 12  # failed trials at most, for each limited response
SPREAD = 12  # trials at least, over the range of a limited response
REACH = 2  # times the largest error found: other errors may be larger
IN_REACH = 20  # trials at least, evaluated because they may cross a limit
OUT = 20  # random ones of the trials out of limit, for each limited response
# of these at least, where trials moved; or a hundredth of all
OUT_MOVED = 100
UNSEEN = 3.7  # random trials that none moves of bound a share of this over their number
THIRD = 8  # trials of a kind: those that moved most, random ones, over the range

Purposes = Mapping[str, Mapping[Reason, Integers]]  # trials, by response and reason


class Selection(NamedTuple):
    """Trials to be evaluated again."""

    trials: Integers  # int64[n]: their numbers, ascending
    # bool[n]: whether a trial was chosen at random, one of each hundred
    at_random: Truths
    # dict of str to uint8[n]: by response, why it chose a trial: sums of `Reason`, 0
    # for none
    reasons: Mapping[str, NDArray[np.uint8]]

    @classmethod
    def joined(
        cls, at_random: Integers, purposes: Purposes | None = None
    ) -> "Selection":
        """Return the selection of random trials, and of others with their reasons."""
        purposes = purposes or {}
        chosen = [
            at_random,
            *(t for reasons in purposes.values() for t in reasons.values()),
        ]
        trials = np.unique(np.concatenate(chosen))
        reasons = {name: np.zeros(len(trials), np.uint8) for name in purposes}
        for name, by_reason in purposes.items():
            for reason, members in by_reason.items():
                reasons[name][np.searchsorted(trials, members)] |= reason.value
        return cls(trials, np.isin(trials, at_random), reasons)


def random_number(trials: Trials, limits: Mapping[str, Limit]) -> int:
    """Return how many random trials show that errors turn no limit that is met.

    If none of them moves, at most 3.7 over their number of all trials do, with a
    certainty of 97.5 %. That fits between what is permitted and the upper end of the
    fraction out of limit.
    """
    ran = trials.status != Status.NOT_RUN
    number = int(np.count_nonzero(ran))
    needed = [0]
    for name, limit in limits.items():
        good = within(trials.response(name), limit.permitted)
        out = int(np.count_nonzero(ran & ~good))
        room = 1 - limit.demanded - anytime_valid(out, number).upper if number else 0.0
        if room > 0:
            needed.append(math.ceil(UNSEEN / room))
    return min(max(needed), len(trials.deviations))


def more_random(seed: int, trials: int, number: int) -> Integers:
    """Return so many random trials, ascending; an extension keeps most of them."""
    order = np.argsort(uniform(seed, "audit", trials, "surely"), kind="stable")
    return np.sort(order[:number])


def random_trials(seed: int, trials: int) -> Integers:
    """Return a random trial of each hundred, ascending; an extension keeps them."""
    first = np.arange(0, trials, EVERY)
    # two words of purpose: parts of a batch may be called "audit", too
    u = uniform(seed, "audit", len(first), "of trials")
    return np.asarray(first + (u * np.minimum(EVERY, trials - first)).astype(np.int64))


def select(
    trials: Trials, limits: Mapping[str, Limit], seed: int, *, sure: bool = False
) -> Selection:
    """Return the trials to evaluate again, where deviations are sampled.

    One trial of each hundred is chosen at random. Each limited response adds those next
    to its limit, the worst, random ones of those out of limit, and some over its range:
    random ones are too few to include rare cases. Without limits every response adds
    its smallest and largest value. The choice depends on numbers of trials and on
    responses, not on workers. `sure` adds random ones: see `random_number`.
    """
    names = [*limits] or [response.name for response in trials.description.responses]
    # another hundredth of the trials: so the stretch evaluated about a limit keeps its
    # width with more of them
    share = len(trials.deviations) // EVERY // len(names)
    purposes = {
        name: _on_purpose(
            trials.response(name), trials.status, limits.get(name, NO_LIMIT), share
        )
        for name in names
    }
    for name, limit in limits.items():
        purposes[name][Reason.OUT] = random_out(trials, name, limit, seed, OUT)
    random = trials.random
    at_random, number = random_trials(seed, len(random.deviations)), 0
    if sure:
        number = random_number(random, limits)
    if number > len(at_random):
        at_random = more_random(seed, len(random.deviations), number)
    return Selection.joined(at_random, purposes)


def select_more(
    trials: Trials, limits: Mapping[str, Limit], audited: Audited, seed: int
) -> Selection:
    """Return more trials, with the errors of the first ones known.

    Those that an error may carry across a limit: they are nearer to it than twice the
    largest error found. Each response has the nearest twenty, or its part of a
    hundredth of the trials if that is more. Where trials moved, more random ones of
    those out of limit, so that "not met" can stand although some of them are within.
    """
    purposes = dict[str, dict[Reason, Integers]]()
    hundredth = len(trials.deviations) // EVERY
    for name, limit in limits.items():
        response = audited.response(name, trials.response(name), limit.permitted)
        distance = np.abs(response.values[:, None] - limit.permitted).min(axis=1)
        distance[audited.trials] = np.inf
        distance[trials.status != Status.DONE] = np.inf
        nearest = np.argsort(distance, kind="stable")
        nearest = nearest[: max(IN_REACH, hundredth // len(limits))]
        largest = np.nanmax([*response.errors, 0.0])
        out = np.zeros(0, np.int64)
        if response.moved.any():
            number = max(OUT_MOVED, hundredth)
            out = random_out(trials, name, limit, seed, number)
        purposes[name] = {
            Reason.NEAR: nearest[distance[nearest] <= REACH * largest],
            Reason.OUT: np.setdiff1d(out, audited.trials),
        }
    return Selection.joined(np.zeros(0, np.int64), purposes)


def random_out(
    trials: Trials, name: str, limit: Limit, seed: int, number: int
) -> Integers:
    """Return random ones of the trials out of limit, failed ones included."""
    trials = trials.random
    ran = trials.status != Status.NOT_RUN
    out = np.flatnonzero(ran & ~within(trials.response(name), limit.permitted))
    order = np.argsort(uniform(seed, "audit", len(out), f"out of limit of {name}"))
    return np.asarray(out[order[:number]])


def select_third(
    trials: Trials, limits: Mapping[str, Limit], audited: Audited
) -> Selection:
    """Return the audited trials to evaluate a third time.

    Eight that moved most beside the spread of a response, with one of each at least;
    eight at random, and eight over the range.
    """
    names = [*limits] or [*audited.responses]
    chosen = [_evenly(audited.trials[audited.at_random], THIRD)]
    for name in names:
        limit = limits.get(name, NO_LIMIT)
        response = audited.response(name, trials.response(name), limit.permitted)
        errors = np.nan_to_num(response.errors, nan=-1.0)
        most = np.argsort(-errors, kind="stable")[: max(1, THIRD // len(names))]
        reasons = audited.chosen_by.get(name, np.zeros(len(errors), np.uint8))
        over_range = audited.trials[(reasons & Reason.SPREAD) > 0]
        chosen.append(audited.trials[most])
        chosen.append(_evenly(over_range, max(2, THIRD // len(names))))
    three_kinds = np.unique(np.concatenate(chosen))
    others = np.setdiff1d(audited.trials, three_kinds)
    more = _evenly(others, max(0, 3 * THIRD - len(three_kinds)))
    return Selection(np.union1d(three_kinds, more), np.zeros(0, np.bool_), {})


def _evenly(trials: Integers, number: int) -> Integers:
    """Return so many of some trials, evenly, the first and the last included."""
    places = np.linspace(0, max(len(trials) - 1, 0), min(number, len(trials)))
    return np.asarray(trials[places.astype(np.int64)])


def _on_purpose(
    values: Array, status: NDArray[np.uint8], limit: Limit, share: int
) -> dict[Reason, Integers]:
    """Return the trials that one response adds."""
    done = np.flatnonzero(status == Status.DONE)
    if not (ends := limit.finite):
        return {Reason.SPREAD: done[spread(values[done], max(2, share // 2))]}
    number = max(NEAREST, share // 4 // len(ends))
    beside_limit = [next_to(values[done], limit, end, number) for end in ends]
    # a failed trial counts as out of limit: it may be done with tighter settings
    failed = np.flatnonzero((status != Status.DONE) & (status != Status.NOT_RUN))
    failed = failed[:: max(1, -(-len(failed) // FAILED))]
    return {
        Reason.NEAR: done[np.concatenate(beside_limit)],
        Reason.WORST: np.concatenate([worst_trials(values, status, limit), failed]),
        Reason.SPREAD: done[spread(values[done], max(SPREAD, share // 2))],
    }


def next_to(values: Array, limit: Limit, end: float, number: int) -> Integers:
    """Return the indices of values next to a limit, as many on either side."""
    distance = np.abs(values - end)
    inside = values >= end if end == limit.lower else values <= end
    sides = [np.flatnonzero(side) for side in (inside, ~inside)]
    return np.concatenate(
        [side[np.argsort(distance[side], kind="stable")[:number]] for side in sides]
    )


def spread(values: Array, number: int) -> Integers:
    """Return the indices of values spread evenly from the least to the largest.

    They are spread by value and not by rank: a rare kind of trial that takes much of
    the range, such as one that jams, is found as often as others. Indices ascend; equal
    values give fewer. No value is NaN.
    """
    if not len(values):
        return np.zeros(0, np.int64)
    order = np.argsort(values, kind="stable")
    ascending = values[order]
    middles = (ascending[1:] + ascending[:-1]) / 2
    targets = np.linspace(ascending[0], ascending[-1], number)
    return np.unique(order[np.searchsorted(middles, targets)])
