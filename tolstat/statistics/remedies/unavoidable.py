"""What stays out of limit whatever the free contributors do, and what would help."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array
from tolstat.statistics.remedies.centring import centred
from tolstat.statistics.remedies.change import Change
from tolstat.statistics.remedies.movable_trials import MovableTrials, Moved
from tolstat.statistics.remedies.prediction import Shares, predicted
from tolstat.statistics.remedies.remedy import ALONE, smallest_change

WITHOUT_SPREAD = 1e-3  # ratio of all free entries
MOST_UNEXPLAINED = 0.05  # of a variance that stays: "nothing helps" needs a surface
FINEST = 1e-3 * WITHOUT_SPREAD  # rounding: the spread that is left is small
AIM_WIDER = 1.1  # margin of a wider limit: fresh trials follow
MOST_FREED = 2  # fixed entries that are tried as free ones, the main ones first


class Freed(NamedTuple):
    """A fixed entry that would meet all limits, were it free."""

    entry: int
    change: Change  # of all entries


class Unavoidable(NamedTuple):
    """What stays when the free entries do not spread at all.

    Attributes
    ----------
    shares : Shares
        Fractions out of limit that stay.
    contributions : float64[entry]
        Share of the variance that stays and that goes with each fixed entry: mean of
        the responses that miss their limits.
    beyond : float64[response]
        How far the median lies above its limit, SI; below 0 if below it.
    freed : tuple of Freed
        Main fixed entries, each of which would help; the one with most variance first.
    """

    shares: Shares
    contributions: Array
    beyond: Array
    freed: tuple[Freed, ...]


def unavoidable(trials: MovableTrials, aim: float) -> Unavoidable | None:
    """Return what no change of the free entries meets; None if a change may."""
    design = trials.design
    exact = replace(trials, design=design._replace(steps=FINEST * design.halves))
    ratios = np.where(design.free, WITHOUT_SPREAD, 1.0)
    without = exact.moved(design.none._replace(ratio=ratios))
    shiftable = np.flatnonzero(design.shiftable).tolist()
    best = centred(without, shiftable, ALONE)
    if best.score >= 1 or _is_remainder(best):
        return None
    contributions = _contributions(best)
    freed = list[Freed]()
    fixed = [i for i in np.argsort(-contributions, kind="stable") if not design.free[i]]
    for entry in fixed[:MOST_FREED]:
        free = design.free | (np.arange(len(design.free)) == entry)
        helped = smallest_change(
            replace(trials, design=design._replace(free=free)), aim
        )
        if helped.score >= aim:
            freed.append(Freed(int(entry), helped.change))
    beyond = best.middle - np.clip(best.middle, *trials.permitted.T)
    shares = predicted(exact, best.change)
    return Unavoidable(shares, contributions, beyond, tuple(freed))


def wider_limits(
    trials: MovableTrials, fresh: MovableTrials, factors: Array
) -> Array | None:
    """Return limits that a design meets as it is, float64[response, end], SI.

    Those of the study where they are met. None if fresh trials do not prove the others,
    or a median lies out of limit.

    Parameters
    ----------
    trials, fresh : MovableTrials
        Of the design as it is: the first ones tell the limits.
    factors : float64[response]
        From SI to the units shown: limits are round there.
    """
    present = trials.moved(trials.design.none)
    if np.any(present.room < 0):
        return None  # no limit is at fault
    shown = factors[:, None]
    reach = AIM_WIDER * present.reach * shown
    if np.any(reach <= 0):
        return None  # a tail without spread tells no limit
    step = 10.0 ** (np.floor(np.log10(reach)) - 1)  # two figures of a reach
    needed = shown * present.middle[:, None] + reach * [-1, 1]
    rounded = np.stack(
        [np.floor(needed[:, 0] / step[:, 0]), np.ceil(needed[:, 1] / step[:, 1])], 1
    )
    wider = np.round(rounded * step, 12) / shown
    limits = np.where(present.margins < AIM_WIDER, wider, trials.permitted)
    proof = replace(fresh, permitted=limits)
    shares = predicted(proof, proof.design.none)
    return limits if shares.permitted(fresh.permitted_out) else None


def _is_remainder(moved: Moved) -> bool:
    """Return whether most of what spreads is what the surface does not explain.

    That would not stay: a model has no spread of its own.
    """
    missed = moved.margins.min(axis=1) < 1
    variance = moved.variance[missed]
    unexplained = moved.origin.surface.remainders[missed] ** 2
    return bool(np.any(unexplained > MOST_UNEXPLAINED * variance))


def _contributions(moved: Moved) -> Array:
    """Return the share of variance that goes with each fixed entry."""
    missed = moved.margins.min(axis=1) < 1
    variance = np.maximum(moved.variance[missed], 1e-300)
    shares = np.zeros(len(moved.change.ratio))
    for entry in np.flatnonzero(~moved.origin.design.free).tolist():
        change = moved.change.with_entry(entry, ratio=WITHOUT_SPREAD)
        rest = moved.moved(change).variance[missed]
        shares[entry] = max(float(np.mean(1 - rest / variance)), 0.0)
    return shares
