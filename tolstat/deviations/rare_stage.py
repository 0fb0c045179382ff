"""Trials of a rare run that are drawn at once, in the space of normal scores."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr, ndtri

from tolstat.arrays import Array
from tolstat.deviations.samplers import Stage, uniform

LEAST_UNIT = 2.0**-53
# how each trial of a rare run was drawn; no response can be called so
STAGE, SPREAD, DISTANCE, WEIGHT = (
    "rare-stage", "rare-spread", "rare-distance", "rare-weight",
)  # fmt: skip


@dataclass(frozen=True)
class RareStage(Stage):
    """Trials that are drawn at once.

    Attributes
    ----------
    spread : float64[trial]
        Times the spread of the study that was aimed at.
    distance : float64[trial]
        From the middle machine, in normal scores: the likelier the nearer.
    weight : float64[trial]
        Density of each as the study has it over that as it was drawn; NaN where
        trials were only sought.
    """

    spread: Array
    distance: Array
    weight: Array

    def columns(self, number: int) -> Mapping[str, Array]:
        """Return what is stored of how each trial was drawn."""
        return {
            STAGE: np.full(len(self.unit), float(number)),
            SPREAD: self.spread,
            DISTANCE: self.distance,
            WEIGHT: self.weight,
        }


def stage_of(points: Array, spread: Array | float, weight: Array | float) -> RareStage:
    """Return the trials at float64[trial, stream] normal scores; see `RareStage`."""
    n = len(points)
    return RareStage(
        np.clip(np.asarray(ndtr(points)), LEAST_UNIT, 1 - LEAST_UNIT),
        np.broadcast_to(np.asarray(spread, np.float64), n),
        np.sqrt(np.einsum("ni,ni->n", points, points)),
        np.broadcast_to(np.asarray(weight, np.float64), n),
    )


def joined(stages: Sequence[RareStage]) -> RareStage:
    """Return several stages as one."""
    rows = ((s.unit, s.spread, s.distance, s.weight) for s in stages)
    return RareStage(*map(np.concatenate, zip(*rows, strict=True)))


def normal_scores(
    seed: int, streams: Mapping[str, int], trials: int, purpose: str
) -> Array:
    """Draw float64[trial, stream], independent and standard normal."""
    scores = np.empty((trials, len(streams)))
    for column, name in enumerate(streams):
        scores[:, column] = ndtri(uniform(seed, name, trials, purpose))
    return scores
