"""Audit of a run: some trials evaluated again, much more precisely.

They are chosen at random, next to a limit, among the worst and those out of limit, and
over the range. A few of them are evaluated a third time: do they move again?
"""

import dataclasses
from collections.abc import Mapping
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.arrays import Array, Integers, Truths
from tolstat.deviations.samplers import uniform
from tolstat.execution.trial_table import Trials
from tolstat.execution.workers.block_scheduler import Workers
from tolstat.model.checked import tightened
from tolstat.model.contract import Model
from tolstat.statistics.limits.limit import NO_LIMIT, Limit, within, worst_trials
from tolstat.status import Status
from tolstat.store.run_records import Audited, Reason, joined
from tolstat.study.given_points import Case, cases_among
from tolstat.study.study import Study

EVERY = 100  # one of so many trials is evaluated again
NEAREST = 4  # trials at least, on either side of each end of a limit
FAILED = 12  # failed trials at most, for each limited response
SPREAD = 12  # trials at least, over the range of a limited response
REACH = 2  # times the largest error found: other errors may be larger
IN_REACH = 20  # trials at least, evaluated because they may cross a limit
OUT = 20  # random ones of the trials out of limit, for each limited response
# of these at least, where trials moved; or a hundredth of all
OUT_MOVED = 100
THIRD = 8  # trials of a kind: those that moved most, random ones, over the range
TIGHTER = 32.0  # rtol of a third evaluation: twice the steps
PARTS = 8  # of the trials at least, by their longest step; or eight trials of each


class Choice(NamedTuple):
    """Trials to be evaluated again."""

    trials: Integers  # int64[n]: their numbers, ascending
    # bool[n]: whether a trial was chosen at random, one of each hundred
    at_random: Truths
    # dict of str to uint8[n]: by response, why it chose a trial: sums of `Reason`, 0
    # for none
    chosen_by: Mapping[str, NDArray[np.uint8]]


def audit(study: Study, trials: Trials, workers: Workers) -> Audited | None:
    """Return some trials evaluated more precisely; None if the model cannot.

    First those of `choose`. Then, with the size of errors known, those that an error
    may carry across a limit, so that the fraction out of limit can be trusted, and more
    of those out of limit where trials moved. A few are evaluated a third time. Of a
    grid or a table one trial of each hundred.
    """
    seed = study.seed or 0
    if study.sampler is None:
        chosen = random_trials(seed, len(trials.deviations))
        return evaluated_again(study, trials, Choice(chosen, chosen >= 0, {}), workers)
    choice = choose(trials, study.limits, seed)
    found = evaluated_again(study, trials, choice, workers)
    if found is None:
        return None
    more = choose_further(trials, study.limits, found, seed)
    if len(more.trials):
        further = evaluated_again(study, trials, more, workers)
        found = joined(found, further) if further else found
    last = Choice(choose_third(trials, study.limits, found), np.zeros(0, np.bool_), {})
    third = evaluated_again(study, trials, last, workers, times=2)
    return dataclasses.replace(found, third=third)


def evaluated_again(
    study: Study, trials: Trials, choice: Choice, workers: Workers, times: int = 1
) -> Audited | None:
    """Return chosen trials evaluated more precisely; None if the model cannot.

    `times`: how often the settings are tightened.
    """
    tight = finer(study.model, study.settings, times)
    if tight is None:
        return None
    before, now = dataclasses.asdict(study.settings), dataclasses.asdict(tight)
    cases = [
        part
        for case in cases_among(study.cases, choice.trials)
        for part in phased(
            case._replace(settings=finer(study.model, case.settings, times)), times
        )
    ]
    rows = trials.deviations[choice.trials]
    found = workers.simulate_cases(study.model, cases, rows)
    names = [response.name for response in study.description.responses]
    return Audited(
        choice.trials,
        {name: float(now[name]) for name in now if now[name] != before[name]},
        found.status.astype(np.uint8),
        dict(zip(names, found.responses.T, strict=True)),
        choice.at_random,
        choice.chosen_by,
    )


def finer(model: Model, settings: Any, times: int = 1) -> Any | None:
    """Return the settings of an audit, or (2 times) of its third evaluation.

    That has a shorter longest step again, and a less tight rtol than tightening twice
    gives: it takes twice the steps of an audit, which is enough to see its errors.
    """
    tight = tightened(model, settings, times)
    if times == 1 or tight is None or not model.integrates:
        return tight
    once: Any = tightened(model, settings)
    rtol = max(once.rtol / TIGHTER, tight.rtol)
    return dataclasses.replace(tight, rtol=rtol)


def phased(case: Case, times: int = 1) -> list[Case]:
    """Return a case in parts whose longest steps differ a little.

    With equal steps all trials may miss the same short event. In a third evaluation
    (2 `times`) trials are few: every two have another longest step.
    """
    settings = case.settings
    if not isinstance(step := getattr(settings, "max_step", None), float):
        return [case]
    trials = case.stop - case.first
    parts = max(PARTS, trials // PARTS) if times == 1 else -(-trials // 2)
    ends = np.unique(np.linspace(case.first, case.stop, parts + 1).astype(int)).tolist()
    shorter = step * (1 - (np.arange(parts) + (times - 1) / 2) / (3 * parts))
    return [
        Case(first, stop, dataclasses.replace(settings, max_step=float(shorter[i])))
        for i, (first, stop) in enumerate(pairwise(ends))
    ]


def random_trials(seed: int, trials: int) -> Integers:
    """Return a random trial of each hundred, ascending; an extension keeps them."""
    first = np.arange(0, trials, EVERY)
    # two words of purpose: parts of a batch may be called "audit", too
    u = uniform(seed, "audit", len(first), "of trials")
    found: Integers = first + (u * np.minimum(EVERY, trials - first)).astype(np.int64)
    return found


def choose(trials: Trials, limits: Mapping[str, Limit], seed: int) -> Choice:
    """Return the trials to evaluate again, where deviations are sampled.

    One trial of each hundred is chosen at random. Each limited response adds those next
    to its limit, the worst, random ones of those out of limit, and some over its range:
    random ones are too few to include rare cases. Without limits every response adds
    its smallest and largest value. The choice depends on numbers of trials and on
    responses, not on workers.
    """
    names = list(limits) or [each.name for each in trials.description.responses]
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
    return _choice(random_trials(seed, len(trials.deviations)), purposes)


def choose_further(
    trials: Trials, limits: Mapping[str, Limit], found: Audited, seed: int
) -> Choice:
    """Return more trials, with the errors of the first ones known.

    Those that an error may carry across a limit: they are nearer to it than twice the
    largest error found. Each response has the nearest twenty, or its part of a
    hundredth of the trials if that is more. Where trials moved, more random ones of
    those out of limit, so that "not met" can stand although some of them are within.
    """
    purposes = dict[str, dict[Reason, Integers]]()
    for name, limit in limits.items():
        response = found.response(name, trials.response(name), limit.permitted)
        share = len(trials.deviations) // EVERY // len(limits)
        distance = np.abs(response.values[:, None] - limit.permitted).min(axis=1)
        distance[found.trials] = np.inf
        distance[trials.status != Status.DONE] = np.inf
        order = np.argsort(distance, kind="stable")[: max(IN_REACH, share)]
        largest = np.nanmax([*response.errors, 0.0])
        near, out = order[distance[order] <= REACH * largest], np.zeros(0, np.int64)
        if response.moved.any():
            number = max(OUT_MOVED, len(trials.deviations) // EVERY)
            out = random_out(trials, name, limit, seed, number)
        purposes[name] = {
            Reason.NEAR: near, Reason.OUT: np.setdiff1d(out, found.trials),
        }  # fmt: skip
    return _choice(np.zeros(0, np.int64), purposes)


def random_out(
    trials: Trials, name: str, limit: Limit, seed: int, number: int
) -> Integers:
    """Return random ones of the trials out of limit, failed ones included."""
    ran = trials.status != Status.NOT_RUN
    out = np.flatnonzero(ran & ~within(trials.response(name), limit.permitted))
    order = np.argsort(uniform(seed, "audit", len(out), f"out of limit of {name}"))
    return np.asarray(out[order[:number]])


def choose_third(
    trials: Trials, limits: Mapping[str, Limit], found: Audited
) -> Integers:
    """Return the audited trials to evaluate a third time, ascending.

    Eight that moved most beside the spread of a response, with one of each at least;
    eight at random, and eight over the range.
    """
    names = list(limits) or list(found.responses)
    chosen = [_some(found.trials[found.at_random])]
    for name in names:
        limit, values = limits.get(name, NO_LIMIT), trials.response(name)
        response = found.response(name, values, limit.permitted)
        errors = np.nan_to_num(response.errors, nan=-1.0)
        most = np.argsort(-errors, kind="stable")[: max(1, THIRD // len(names))]
        reasons = found.chosen_by.get(name, np.zeros(len(errors), np.uint8))
        over = found.trials[(reasons & Reason.SPREAD) > 0]
        chosen += [found.trials[most], _some(over, max(2, THIRD // len(names)))]
    three_kinds = np.unique(np.concatenate(chosen))
    others = np.setdiff1d(found.trials, three_kinds)
    more = _some(others, max(0, 3 * THIRD - len(three_kinds)))
    return np.union1d(three_kinds, more)


def _some(trials: Integers, number: int = THIRD) -> Integers:
    """Return so many of some trials, evenly, the first and the last included."""
    where = np.linspace(0, max(len(trials) - 1, 0), min(number, len(trials)))
    return np.asarray(trials[where.astype(np.int64)])


def _choice(
    at_random: Integers, purposes: Mapping[str, Mapping[Reason, Integers]]
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
) -> dict[Reason, Integers]:
    """Return the trials that one response adds."""
    done = np.flatnonzero(status == Status.DONE)
    known = values[done]
    if not (ends := limit.finite):
        return {Reason.SPREAD: done[spread(known, max(2, share // 2))]}
    number = max(NEAREST, share // 4 // len(ends))
    near = np.concatenate([next_to(known, limit, end, number) for end in ends])
    # a failed trial counts as out of limit: it may be done with tighter settings
    failed = np.flatnonzero((status != Status.DONE) & (status != Status.NOT_RUN))
    failed = failed[:: max(1, -(-len(failed) // FAILED))]
    return {
        Reason.NEAR: done[near],
        Reason.WORST: np.concatenate([worst_trials(values, status, limit), failed]),
        Reason.SPREAD: done[spread(known, max(SPREAD, share // 2))],
    }


def next_to(values: Array, limit: Limit, end: float, number: int) -> Integers:
    """Return the indices of values next to a limit, as many on either side."""
    distance = np.abs(values - end)
    within = values >= end if end == limit.lower else values <= end
    sides = [np.flatnonzero(side) for side in (within, ~within)]
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
    wanted = np.linspace(ascending[0], ascending[-1], number)
    return np.unique(order[np.searchsorted(middles, wanted)])
