"""Audit of a run: some trials evaluated again, much more precisely.

They are chosen at random, next to a limit, among the worst, and over the range.
"""

import dataclasses
from collections.abc import Mapping
from itertools import pairwise
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
from tolstat.study.given_points import Case, cases_among
from tolstat.study.study import Study

EVERY = 100  # one of so many trials is evaluated again
NEAREST = 4  # trials at least, on either side of each end of a limit
FAILED = 12  # failed trials at most, for each limited response
SPREAD = 12  # trials at least, over the range of a limited response
REACH = 2  # times the largest error found: other errors may be larger
IN_REACH = 20  # trials at least, evaluated because they may cross a limit
PARTS = 8  # of the trials, by their longest step
NO_LIMIT = Limit(-np.inf, np.inf)


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
    may carry across a limit, so that the fraction out of limit can be trusted. Of a
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
    errors = {name: _largest_error(trials, found, name) for name in study.limits}
    more = choose_in_reach(trials, study.limits, choice, errors)
    if not len(more.trials):
        return found
    further = evaluated_again(study, trials, more, workers)
    return further and joined(found, further)


def evaluated_again(
    study: Study, trials: Trials, choice: Choice, workers: Workers
) -> Audited | None:
    """Return chosen trials evaluated more precisely; None if the model cannot."""
    tight = tightened(study.model, study.settings)
    if tight is None:
        return None
    before, now = dataclasses.asdict(study.settings), dataclasses.asdict(tight)
    cases = [
        part
        for case in cases_among(study.cases, choice.trials)
        for part in _parts(case._replace(settings=study.model.tightened(case.settings)))
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


def _parts(case: Case) -> list[Case]:
    """Return a case in parts whose longest steps differ a little.

    With equal steps all trials may miss the same short event.
    """
    settings = case.settings
    if not isinstance(step := getattr(settings, "max_step", None), float):
        return [case]
    ends = np.unique(np.linspace(case.first, case.stop, PARTS + 1).astype(int)).tolist()
    return [
        Case(first, stop, dataclasses.replace(settings, max_step=step * (1 - i / 24)))
        for i, (first, stop) in enumerate(pairwise(ends))
    ]


def _largest_error(trials: Trials, audited: Audited, name: str) -> float:
    errors = np.abs(trials.response(name)[audited.trials] - audited.responses[name])
    known = errors[np.isfinite(errors)]
    return float(known.max()) if len(known) else np.nan


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
    to its limit, the worst, and some over its range: random ones are too few to include
    rare cases. Without limits every response adds its smallest and largest value. The
    choice depends on numbers of trials and on responses, not on workers.
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
    return _choice(random_trials(seed, len(trials.deviations)), purposes)


def choose_in_reach(
    trials: Trials,
    limits: Mapping[str, Limit],
    known: Choice,
    errors: Mapping[str, float],
) -> Choice:
    """Return more trials, which an error may carry across a limit.

    They are nearer to a limit than twice the largest error found (NaN if there is
    none). Each response has the nearest twenty, or its part of a hundredth of the
    trials if that is more.
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
