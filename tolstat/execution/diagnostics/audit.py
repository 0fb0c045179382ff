"""Some trials again, evaluated much more precisely: which ones, and what they answer.

They are chosen at random, next to a limit, among the worst, and over the range.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.arrays import Array, Integers, Truths
from tolstat.deviations.samplers import uniform
from tolstat.execution.trial_table import Trials
from tolstat.execution.workers.crew import Workers
from tolstat.model.checked import tightened
from tolstat.statistics.limits.limit import Limit, worst_trials
from tolstat.status import Status
from tolstat.store.run_records import Audited, Reason, joined
from tolstat.study.given_points import cases_among
from tolstat.study.study import Study

EVERY = 100  # trials of which one is evaluated again
NEAREST = 4  # trials at least, on either side of each end of a limit
SPREAD = 12  # trials at least, over the range of a limited response
REACH = 2  # times the largest error seen: others may err more
IN_REACH = 20  # trials at least, that may be looked at because they may change sides
NO_LIMIT = Limit(-np.inf, np.inf)


class Choice(NamedTuple):
    """Trials to be evaluated again."""

    trials: Integers  # int64[n]: their numbers, ascending
    # bool[n]: whether a trial is the one of its hundred that was chosen at random
    at_random: Truths
    # dict of str to uint8[n]: by response that chose trials on purpose: sums of
    # `Reason`, 0 for none
    chosen_by: Mapping[str, NDArray[np.uint8]]


def audit(study: Study, trials: Trials, workers: Workers) -> Audited | None:
    """Evaluate some trials more precisely; None for a model that cannot be.

    First those of `choose`; then, once it is known how large errors are, what they may
    carry across a limit, so that the fraction out of limit can be trusted. Of a grid or
    a table, which the user chose, one of each hundred.
    """
    seed = study.seed or 0
    if study.sampler is None:
        chosen = random_trials(seed, len(trials.deviations))
        return evaluated_again(study, trials, Choice(chosen, chosen >= 0, {}), workers)
    choice = choose(trials, study.limits, seed)
    found = evaluated_again(study, trials, choice, workers)
    if found is None:
        return None
    errors = {name: _largest_error(trials, found, name) for name in study.limits}
    more = choose_in_reach(trials, study.limits, choice, errors)
    if not len(more.trials):
        return found
    further = evaluated_again(study, trials, more, workers)
    return further and joined(found, further)


def evaluated_again(
    study: Study, trials: Trials, choice: Choice, workers: Workers
) -> Audited | None:
    """Evaluate chosen trials more precisely; None for a model that cannot be."""
    tight = tightened(study.model, study.settings)
    if tight is None:
        return None
    before, now = dataclasses.asdict(study.settings), dataclasses.asdict(tight)
    cases = [
        case._replace(settings=study.model.tightened(case.settings))
        for case in cases_among(study.cases, choice.trials)
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


def _largest_error(trials: Trials, audited: Audited, name: str) -> float:
    errors = np.abs(trials.response(name)[audited.trials] - audited.responses[name])
    known = errors[np.isfinite(errors)]
    return float(known.max()) if len(known) else np.nan


def random_trials(seed: int, trials: int) -> Integers:
    """Choose one trial at random of each hundred, whatever trials follow; ascending."""
    first = np.arange(0, trials, EVERY)
    # with a purpose: parts of a batch may be called so, too
    u = uniform(seed, "audit", len(first), "of trials")
    found: Integers = first + (u * np.minimum(EVERY, trials - first)).astype(np.int64)
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
    found: dict[str, dict[Reason, Integers]] = {}
    for name, limit in limits.items():
        share = len(trials.deviations) // EVERY // len(limits)
        distance = np.abs(trials.response(name)[:, None] - limit.permitted).min(axis=1)
        distance[known.trials] = np.inf
        distance[trials.status != Status.DONE] = np.inf
        order = np.argsort(distance, kind="stable")[: max(IN_REACH, share)]
        found[name] = {Reason.NEAR: order[distance[order] <= REACH * errors[name]]}
    return _choice(np.zeros(0, np.int64), found)


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
        Reason.WORST: worst_trials(values, status, limit),
        Reason.SPREAD: done[spread(known, max(SPREAD, share // 2))],
    }


def next_to(values: Array, limit: Limit, end: float, number: int) -> Integers:
    """Find the places of values next to an end of a limit, as many on either side."""
    distance = np.abs(values - end)
    within = values >= end if end == limit.lower else values <= end
    sides = [np.flatnonzero(side) for side in (within, ~within)]
    return np.concatenate(
        [side[np.argsort(distance[side], kind="stable")[:number]] for side in sides]
    )


def spread(values: Array, number: int) -> Integers:
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
