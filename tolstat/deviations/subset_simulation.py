"""Subset simulation: trials that approach a limit step by step."""

from collections.abc import Generator, Mapping
from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array
from tolstat.deviations.mixture import Mixture, fitted
from tolstat.deviations.rare_stage import RareStage, joined, normal_scores, stage_of
from tolstat.deviations.samplers import uniform

CHAINS = 2  # independent of each other: one may keep a region that the other loses
KEPT = 0.25  # of the trials at a step: those nearest to the limit
STEPS = 14  # to the limit, at most
MOVES = np.array([0.15, 0.3, 0.6])  # of the spread: how far a trial is moved
CLONES = 8  # trials per effective one: they descend from few


class Nearest(NamedTuple):
    """Trials found along the response.

    Attributes
    ----------
    mixture : Mixture or None
        Fitted to trials out of limit; None if none was found.
    trials : int
        Number of trials used.
    """

    mixture: Mixture | None
    trials: int


def subset_simulation(
    seed: int, streams: Mapping[str, int], trials: int
) -> Generator[RareStage, Array, Nearest]:
    """Yield stages that approach the limit step by step; return the fit at the end.

    The first trials are those of the study. The quarter nearest to the limit is kept
    and multiplied. Each trial is moved a little; it stays in place if the move leads
    farther from the limit than that quarter. This finds trials with several extreme
    parts, which a greater spread hardly meets. It misses regions to which the response
    does not lead. The smaller of two kinds may die out: two halves run independently.

    Returns
    -------
    Nearest

    References
    ----------
    S.-K. Au, J. L. Beck, Estimation of small failure probabilities in high dimensions
    by subset simulation, Prob. Eng. Mech. 16 (2001) 263-277. I. Papaioannou et al.,
    MCMC algorithms for subset simulation, Prob. Eng. Mech. 41 (2015) 89-103: the moves.
    """
    goes = [_chain(seed, streams, trials // CHAINS, f"near {i}") for i in range(CHAINS)]
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
    worth = max(len(np.unique(found[:, 0])) / CLONES, 2.0)
    return Nearest(fitted(found, worth, 1.0), drawn)


def _chain(
    seed: int, streams: Mapping[str, int], trials: int, name: str
) -> Generator[RareStage, Array, Array]:
    """Yield the stages of one chain; return its trials out of limit, or none."""
    points = normal_scores(seed, streams, trials, f"{name} 0")
    margins = yield stage_of(points, 1.0, np.nan)
    before = np.inf
    for step in range(1, STEPS):
        order = np.argsort(margins, kind="stable")
        out_of_limit = int(np.count_nonzero(margins < 0))
        kept = max(int(KEPT * trials), out_of_limit)
        level = margins[order[kept - 1]]
        if level >= before:
            break  # the response is flat
        chosen = order[np.arange(trials) * kept // trials]
        purpose = f"{name} {step}"
        which = uniform(seed, "moves", trials, f"of {purpose}") * len(MOVES)
        far = MOVES[which.astype(np.int64)][:, None]
        # this move keeps the distribution of the study
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
