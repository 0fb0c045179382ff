"""Shares out of limit after a change: of moved trials, and of fresh ones."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from itertools import count
from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array, Truths
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.limits.limit import rounded_out
from tolstat.statistics.remedies.change import Change
from tolstat.statistics.remedies.movable_trials import MovableTrials
from tolstat.statistics.remedies.remedy import (
    AIM_PROVED,
    MOST_TRIALS,
    one_shift,
    smallest_change,
)
from tolstat.statistics.remedies.surface import NONLINEAR, REMAINDER, UNEXPLAINED

MOST_ERROR = 0.1  # of what shifts gain: one shift instead of several
ROUNDS = 4  # searches, the later ones from the fresh trials of the one before
ALL_TIGHTER = 0.7, 0.5, 0.35  # ratios of all free entries: where searches fail


class Shares(NamedTuple):
    """Fractions out of limit.

    Attributes
    ----------
    joint : Estimate
        Out of at least one limit.
    limits : tuple of Estimate
        Of each response.
    thinned : bool
        Whether trials were thinned. The upper ends then include kinds of units that
        no trial shows: they are out of limit before a change as well as after it.
    likely : float
        Upper end of the joint share if a poor surface bends rightly.
    """

    joint: Estimate
    limits: tuple[Estimate, ...]
    thinned: bool = False
    likely: float = math.inf

    def permitted(self, permitted_out: Array) -> bool:
        """Return whether the whole interval of each limit is permitted."""
        pairs = zip(self.limits, permitted_out, strict=True)
        return all(share.upper <= most for share, most in pairs)

    def missed(self, permitted_out: Array) -> list[bool]:
        """Return whether no value in the interval of each limit is permitted."""
        pairs = zip(self.limits, permitted_out.tolist(), strict=True)
        return [share.lower > most for share, most in pairs]

    def improve(self, before: Shares, permitted_out: Array) -> bool:
        """Return whether they are surely better, and push no response out of its limit.

        The whole interval of the joint share, if the surface bends rightly, has to lie
        below the share before; of thinned trials the share below the whole interval
        before. And that of no limit may lie above its interval before and above what is
        permitted.
        """
        pushed = (
            after.lower > max(share.upper, most)
            for after, share, most in zip(
                self.limits, before.limits, permitted_out, strict=True
            )
        )
        better = min(self.joint.upper, self.likely) < before.joint.value
        if self.thinned:
            better = self.joint.value < before.joint.lower
        return better and not any(pushed)


class Step(NamedTuple):
    """Entries that change together."""

    change: Change  # of these alone
    after: Shares  # after this and earlier steps


class Proof(NamedTuple):
    """A change, and what fresh trials of it show."""

    change: Change
    after: Shares
    seed: int  # of the fresh trials: counted from 0
    met: bool  # all limits, by the whole intervals
    improves: bool  # nothing else may be called a remedy
    steps: tuple[Step, ...] = ()  # by fresh trials, too


# deviations and responses of fresh trials after a change, SI; NaN in failed trials. And
# their seed: equal ones have common random numbers
Sampled = Callable[[Change, int], tuple[Array, Array]]


def predicted(trials: MovableTrials, change: Change) -> Shares:
    """Predict shares out of limit from all stored trials, moved by a change.

    The ends of an interval are those of Clopper and Pearson, of thinned trials those of
    `thinned_share`, with all responses moved a little: a quarter of what bends add; of
    a poor surface all of it, and half of its remainder. Without a change they are those
    of the trials as stored.
    """
    as_moved, least, most, likely = _outs(trials, change)
    permitted = float(trials.permitted_out.max())
    any_out = (np.any(out, axis=1) for out in (as_moved, least, most))
    joint = _share(trials, any_out, permitted)
    columns = zip(as_moved.T, least.T, most.T, trials.permitted_out, strict=True)
    shares = tuple(_share(trials, outs, p) for *outs, p in columns)
    upper = trials.share(np.any(likely, axis=1), permitted).upper
    return Shares(joint, shares, trials.thinned is not None, upper)


def _outs(trials: MovableTrials, change: Change) -> list[Truths]:
    """Return which are out of limit after a change: as moved, at least, at most.

    And at most if the surface bends rightly. Each is bool[trial, response].
    """
    moved, surface = trials.moved(change).responses, trials.surface
    shift, ratio = trials.design.members(change)
    linear = trials.responses + surface.straight.change(trials.z, shift, ratio)
    poor = surface.remainders > UNEXPLAINED * trials.responses.std(axis=0)
    size = min(1.0, float(np.abs(shift).sum() + (1 - ratio).sum()))
    rest = REMAINDER * size * np.where(poor, surface.remainders, 0.0)
    bends = np.abs(linear - moved)
    likely = NONLINEAR * bends + rest
    error = np.where(poor, 1.0, NONLINEAR) * bends + rest
    lower, upper = rounded_out(*trials.permitted.T)
    return [
        (moved - widened < lower) | (moved + widened > upper)
        for widened in (np.zeros_like(error), -error, error, likely)
    ]


def _share(trials: MovableTrials, outs: Iterable[Truths], permitted: float) -> Estimate:
    """Estimate a share from trials out of limit: as moved, at least, at most."""
    value, least, most = (trials.share(out, permitted) for out in outs)
    return Estimate(value.value, least.lower, most.upper)


def steps(
    trials: MovableTrials, change: Change, shares: Callable[[Change], Shares]
) -> Iterator[Step]:
    """Yield the steps of a change, the one that helps most first.

    All shifts are one step: one alone may push a response out of its limit. So is a
    change that does not surely help, and the next one. The last changes are left out
    where they neither surely help nor meet all limits. `shares` returns those out of
    limit after a change.
    """
    permitted, before = trials.permitted_out, predicted(trials, trials.design.none)
    step = done = trials.design.none
    is_first = True
    for single in _ordered(trials, change):
        step, done = both(step, single), both(done, single)
        after = shares(done)
        whole = _equal(done, change) and (is_first or after.permitted(permitted))
        if whole or after.improve(before, permitted):
            yield Step(step, after)
            step, before, is_first = trials.design.none, after, False


def _equal(first: Change, second: Change) -> bool:
    return all(map(np.array_equal, first, second))


def _ordered(trials: MovableTrials, change: Change) -> Iterator[Change]:
    """Yield single changes, the one that is predicted to help most first."""
    none = done = trials.design.none
    waiting = [none.with_entry(e, ratio=change.ratio[e]) for e in change.tightened]
    if change.size:
        waiting.append(none._replace(shift=change.shift))
    ordering = trials.at_most(MOST_TRIALS)
    while waiting:
        moved = (_outs(ordering, both(done, step))[0] for step in waiting)
        outs = [np.any(out, axis=1) for out in moved]
        step = waiting.pop(int(np.argmin([ordering.out_of(out) for out in outs])))
        done = both(done, step)
        yield step


def proved(trials: MovableTrials, sample: Sampled) -> Proof | None:
    """Search a change and try it with fresh trials; again from these until it is met.

    None if no change is found. One shift that meets all limits, if only just, is
    preferred to more changes; and what a met change does not need is left out. Its
    steps have the fresh trials of its seed, and end where all limits are met. All free
    entries tightened alike are one step.
    """
    proof, permitted_out = _searched(trials, sample), trials.permitted_out
    if proof is None or not proof.improves or proof.steps:
        return proof

    def shares(change: Change) -> Shares:
        if _equal(change, proof.change):
            return proof.after
        return _fresh_shares(trials.sampled_again(change, *sample(change, proof.seed)))

    found, change = list[Step](), trials.design.none
    for step in steps(trials, proof.change, shares):
        found.append(step)
        change, met = both(change, step.change), step.after.permitted(permitted_out)
        if met:
            break
    return proof._replace(
        change=change, after=found[-1].after, met=met, steps=tuple(found)
    )


def _fresh_shares(fresh: MovableTrials) -> Shares:
    return predicted(fresh, fresh.design.none)


def _searched(trials: MovableTrials, sample: Sampled) -> Proof | None:
    change, fresh, proof = trials.design.none, trials, None
    before, seeds = predicted(trials, trials.design.none), count()

    def tried(change: Change, seed: int | None = None) -> tuple[MovableTrials, Proof]:
        seed = next(seeds) if seed is None else seed
        fresh = trials.sampled_again(change, *sample(change, seed))
        after = _fresh_shares(fresh)
        met = after.permitted(trials.permitted_out)
        improves = after.improve(before, trials.permitted_out)
        return fresh, Proof(change, after, seed, met, improves)

    present = trials.moved(change).score
    alone = one_shift(trials) if present < AIM_PROVED else None
    if alone and alone.change.size and 1 <= alone.score < AIM_PROVED:
        _, simple = tried(trials.design.rounded(alone.change))
        if simple.met and simple.improves:
            return simple
    for _ in range(ROUNDS):
        added = smallest_change(fresh, AIM_PROVED).change
        if not (added.size or len(added.tightened)):
            break
        change = trials.design.rounded(change.followed_by(added))
        fresh, proof = tried(change)
        if proof.met:
            break
    if proof and proof.met:
        for fewer in (*_one_shift(trials, proof.change), *_fewer(trials, proof.change)):
            _, simple = tried(trials.design.rounded(fewer))
            if simple.met and simple.improves:
                return simple
        return proof
    none = trials.design.none
    for ratio in ALL_TIGHTER if present < AIM_PROVED else ():
        ratios = np.where(trials.design.free, ratio, 1.0)
        _, alike = tried(trials.design.rounded(none._replace(ratio=ratios)))
        if alike.met and alike.improves:
            return alike._replace(steps=(Step(alike.change, alike.after),))
    if proof and len(proof.change.shifted) and len(proof.change.tightened):
        # shifts may cancel, or follow what a surface has by chance
        _, unshifted = tried(proof.change._replace(shift=none.shift), proof.seed)
        if unshifted.improves and unshifted.after.joint.value < proof.after.joint.upper:
            return unshifted
    return proof


def _one_shift(trials: MovableTrials, change: Change) -> Iterator[Change]:
    """Yield a change with one shift instead of several that gains nearly as much."""
    shifted, design = change.shifted, trials.design
    if len(shifted) < 2:
        return
    sigma = trials.responses.std(axis=0) + 1e-300
    slopes = trials.moved(design.none).slopes[shifted] / sigma
    gain = change.shift[shifted] @ slopes
    lowest = design.lowest + np.zeros(len(change.shift))
    for entry, slope in zip(shifted.tolist(), slopes, strict=True):
        by = gain @ slope / (slope @ slope)
        error = np.linalg.norm(gain - by * slope)
        if error <= MOST_ERROR * np.linalg.norm(gain) and by > lowest[entry]:
            yield change._replace(shift=design.none.with_entry(entry, shift=by).shift)


def _fewer(trials: MovableTrials, change: Change) -> Iterator[Change]:
    """Yield a change without its shifts, and without single ones, if likely enough."""
    options = list[Change]()
    if len(change.shifted) and len(change.tightened):
        options.append(change._replace(shift=np.zeros_like(change.shift)))
    if len(change.shifted) + len(change.tightened) > 1:
        parts = sorted({*change.shifted.tolist(), *change.tightened.tolist()})
        options += [change.with_entry(i, shift=0.0, ratio=1.0) for i in parts]
    for option in options:
        if trials.moved(option).score >= 1:
            yield option


def both(first: Change, second: Change) -> Change:
    """Return changes of different kinds or entries together."""
    return Change(first.shift + second.shift, first.ratio * second.ratio)
