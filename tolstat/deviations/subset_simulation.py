"""Machines that come nearer and nearer to a limit: what their response leads to."""

from __future__ import annotations

from collections.abc import Generator, Mapping
from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array
from tolstat.deviations.mixture import Mixture, fitted
from tolstat.deviations.rare_stage import RareStage, joined, normal_scores, stage_of
from tolstat.deviations.samplers import uniform

GOES = 2  # side by side: what one loses the other may keep
KEPT = 0.25  # of the trials at a step: those nearest to the limit
STEPS = 14  # to the limit, at most
MOVES = np.array([0.15, 0.3, 0.6])  # of the spread: how far a trial is moved
ALIKE = 8  # trials that are worth one: they come from few


class Nearest(NamedTuple):
    """Where a response leads.

    Attributes
    ----------
    mixture : Mixture or None
        Fitted to trials out of limit; None if it led to none.
    trials : int
        That were drawn for it.
    """

    mixture: Mixture | None
    trials: int


def subset_simulation(
    seed: int, streams: Mapping[str, int], trials: int
) -> Generator[RareStage, Array, Nearest]:
    """Go to the limit step by step.

    Of trials as the study has them the quarter nearest to the limit is kept, and
    multiplied. Each is moved a little, and stays where it was if it came to lie farther
    from the limit than that quarter. This finds trials with several parts in a corner,
    which a greater spread hardly meets. It misses what the response does not lead to.
    Of two kinds the smaller one may die out by chance among so few: so two halves of
    the trials go by themselves.

    Returns
    -------
    Nearest

    References
    ----------
    S.-K. Au, J. L. Beck, Estimation of small failure probabilities in high dimensions
    by subset simulation, Prob. Eng. Mech. 16 (2001) 263-277. I. Papaioannou et al.,
    MCMC algorithms for subset simulation, Prob. Eng. Mech. 41 (2015) 89-103: the moves.
    """
    goes = [_go(seed, streams, trials // GOES, f"near {i}") for i in range(GOES)]
    steps = [next(go) for go in goes]
    found, drawn = np.empty((0, len(streams))), 0
    while goes:
        stage = joined(steps)
        drawn += len(stage.unit)
        ends = np.cumsum([len(step.unit) for step in steps])[:-1]
        answers = np.split((yield stage), ends)
        going, goes, steps = goes, [], []
        for go, margins in zip(going, answers, strict=True):
            try:
                steps.append(go.send(margins))
                goes.append(go)
            except StopIteration as end:
                found = np.concatenate([found, end.value])
    if not len(found):
        return Nearest(None, drawn)
    worth = max(len(np.unique(found[:, 0])) / ALIKE, 2.0)
    return Nearest(fitted(found, worth, 1.0), drawn)


def _go(
    seed: int, streams: Mapping[str, int], trials: int, name: str
) -> Generator[RareStage, Array, Array]:
    """Return float64[trial, stream], trials out of limit, or none."""
    points = normal_scores(seed, streams, trials, f"{name} 0")
    margins = yield stage_of(points, 1.0, np.nan)
    before = np.inf
    for step in range(1, STEPS):
        order = np.argsort(margins, kind="stable")
        out_of_limit = int(np.count_nonzero(margins < 0))
        kept = max(int(KEPT * trials), out_of_limit)
        level = margins[order[kept - 1]]
        if level >= before:
            break  # the response is flat, and leads nowhere
        chosen = order[np.arange(trials) * kept // trials]
        purpose = f"{name} {step}"
        which = uniform(seed, "moves", trials, f"of {purpose}") * len(MOVES)
        far = MOVES[which.astype(np.int64)][:, None]
        # so moved, trials as the study has them remain such
        moved = np.sqrt(1 - far**2) * points[chosen]
        moved += far * normal_scores(seed, streams, trials, purpose)
        answer = yield stage_of(moved, 1.0, np.nan)
        nearer = answer < 0 if level < 0 else answer <= level
        points = np.where(nearer[:, None], moved, points[chosen])
        margins = np.where(nearer, answer, margins[chosen])
        if level < 0:
            return points
        before = level
    return points[:0]
