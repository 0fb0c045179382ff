"""The smallest change found that meets all limits together."""

from collections.abc import Iterator
from itertools import combinations

import numpy as np

from tolstat.arrays import Integers
from tolstat.statistics.remedies.centring import CENTRED, centred
from tolstat.statistics.remedies.movable_trials import MovableTrials, Moved

AIM_PROVED, AIM_PREDICTED = 1.05, 1.15  # score: fresh trials follow, or none do
# half tolerances that a centre moves: if no median is out of limit, if one is; alone,
# where no other change does as well
NEAR, FAR, ALONE = 3.0, 30.0, 1000.0
EFFECT_DECIMALS = 2  # of an effect over sigma
SINGLE = 24  # steepest entries shifted alone
PAIRED, TOGETHER = 8, 12  # of these in pairs; all together
LARGER = 1.1, 0.05  # times, plus: what more entries have to gain
RATIOS = 0.8, 0.63, 0.5, 0.4, 0.32, 0.25
WIDER = 1.0, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3
LARGEST_STEP = 0.5  # ratio of a step that does not reach the aim
TIGHTENINGS = 16
HARM = 0.05  # by which a step may lower the score
GAIN = 0.01  # by which a step has to lower the deficit
MOST_TRIALS = 6_000  # moved in the search


def smallest_change(trials: MovableTrials, aim: float) -> Moved:
    """Search shifts, then tighter tolerances, until the score reaches an aim.

    The score may stay below it: see `unavoidable`.
    """
    trials = trials.at_most(MOST_TRIALS)
    moved = trials.moved(trials.design.none)
    if moved.score >= aim:
        return moved
    return _relaxed(_tightened(_shifted(moved, aim), aim), aim)


def one_shift(trials: MovableTrials) -> Moved:
    """Return the shift of one entry that centres best; other margins may be small."""
    moved = trials.at_most(MOST_TRIALS).moved(trials.design.none)
    best = moved
    for farthest in (_near(moved), ALONE):
        options = [centred(moved, [entry], farthest) for entry in _shiftable(moved)]
        best = max(options, key=lambda option: option.score, default=moved)
        if best.score >= 1:
            break
    return best


def steepest(moved: Moved) -> Integers:
    """Return the free entries, the one that moves some response most first."""
    effects = np.abs(moved.slopes) / (moved.origin.responses.std(axis=0) + 1e-300)
    largest = np.round(effects.max(axis=1), EFFECT_DECIMALS)  # equal ones as they stand
    order = np.argsort(-largest, kind="stable")
    return np.asarray(order[moved.origin.design.free[order]])


def _shiftable(moved: Moved) -> list[int]:
    """Return entries that may be shifted, the steepest first."""
    movable = moved.origin.design.movable
    order = [entry for entry in steepest(moved).tolist() if movable[entry]]
    return order[:SINGLE]


def _near(moved: Moved) -> float:
    return NEAR if moved.score >= 0 else FAR


def _shifted(moved: Moved, aim: float) -> Moved:
    """Shift one entry; if the aim needs it farther, or two, or many."""
    best, order, near = moved, _shiftable(moved), _near(moved)
    alone = [[entry] for entry in order]
    for sets, farthest in (
        (alone, near),
        (alone, ALONE),
        (combinations(order[:PAIRED], 2), near),
        ([order[:TOGETHER]], near),
    ):
        factor, more = LARGER if best.change.size else (1.0, 0.02)
        options = [centred(moved, entries, farthest) for entries in sets]
        candidate = max(options, key=_centredness, default=best)
        if candidate.score > max(best.score * factor, best.score + more):
            best = candidate
        if best.score >= aim:
            break
    return best


def _centredness(moved: Moved) -> tuple[float, float]:
    """Return the order of shifts: their margin in tenths, then the least sum."""
    return round(min(moved.score, CENTRED), 1), -round(moved.change.size, 1)


def _tightened(moved: Moved, aim: float) -> Moved:
    """Tighten one entry after another; shifts follow."""
    for _ in range(TIGHTENINGS):
        if moved.score >= aim:
            break
        before = moved.deficit(aim)
        steps = [*_tighter(moved)]
        reaching = [step for step in steps if step[1].score >= aim]
        if reaching:
            return min(reaching, key=lambda step: (step[0], -step[1].score))[1]
        least, largest = moved.score - HARM, -np.log(LARGEST_STEP) + 1e-9
        helping = [
            ((before - step.deficit(aim)) / cost, step)
            for cost, step in steps
            if step.score > least and cost <= largest
        ]
        _, best = max(helping, key=lambda pair: pair[0], default=(0.0, moved))
        if best.deficit(aim) > before - GAIN:
            break
        shifted = best.change.shifted.tolist()
        moved = centred(best, shifted, _near(best)) if shifted else best
    return moved


def _tighter(moved: Moved) -> Iterator[tuple[float, Moved]]:
    """Yield steps with their cost: the logarithm of old over new tolerance."""
    present, origin = moved.change.ratio, moved.origin
    for entry in steepest(moved)[:TOGETHER]:
        for ratio in RATIOS:
            change = origin.design.rounded(moved.change.with_entry(entry, ratio=ratio))
            if change.ratio[entry] < present[entry]:
                cost = np.log(present[entry] / change.ratio[entry])
                yield float(cost), moved.moved(change)


def _relaxed(moved: Moved, aim: float) -> Moved:
    """Widen tolerances again, and leave out shifts, that the aim does not need."""
    enough, origin = min(moved.score, aim), moved.origin
    for entry in moved.change.tightened:
        for ratio in WIDER:
            change = origin.design.rounded(moved.change.with_entry(entry, ratio=ratio))
            if change.ratio[entry] <= moved.change.ratio[entry]:
                break
            wider = moved.moved(change)
            if wider.score >= enough:
                moved = wider
                break
    for entry in moved.change.shifted:
        unshifted = moved.moved(moved.change.with_entry(entry, shift=0.0))
        if unshifted.score >= enough:
            moved = unshifted
    return moved
