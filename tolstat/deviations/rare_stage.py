"""Trials of a rare run that are sampled at once, in the space of normal scores."""

from collections.abc import Generator, Mapping
from dataclasses import dataclass
from typing import NamedTuple, TypeVar

import numpy as np
from scipy.special import ndtr, ndtri

from tolstat.arrays import Array, Integers
from tolstat.deviations.samplers import DISTANCE, SPREAD, STAGE, WEIGHT, Stage, uniform

LEAST_UNIT = 2.0**-53


@dataclass(frozen=True)
class RareStage(Stage):
    """Trials that are sampled at once.

    Attributes
    ----------
    spread : float64[trial]
        Spread of the target of the stage, over that of the study.
    distance : float64[trial]
        Distance from the middle trial, in normal scores; near trials are likelier.
    """

    spread: Array
    distance: Array

    @property
    def weight(self) -> Array:
        """Density of each trial in the study over its density in the stage."""
        return np.exp(self.log_ratio)

    def columns(self) -> Mapping[str, Array]:
        """Return the stored columns of the sampling of each trial."""
        return {
            STAGE: np.full(len(self.unit), float(self.number)),
            SPREAD: self.spread,
            DISTANCE: self.distance,
            WEIGHT: self.weight,
        }


Found = TypeVar("Found")
Stages = Generator[RareStage, Array, Found]  # stages for margins; returns what is found


def stage_of(
    points: Array, spread: Array | float = 1.0, log_ratio: Array | float = np.nan
) -> RareStage:
    """Return the trials at float64[trial, stream] normal scores; see `RareStage`."""
    n = len(points)
    return RareStage(
        np.clip(np.asarray(ndtr(points)), LEAST_UNIT, 1 - LEAST_UNIT),
        np.broadcast_to(np.asarray(log_ratio, np.float64), n),
        np.broadcast_to(np.asarray(spread, np.float64), n),
        np.sqrt(np.einsum("ni,ni->n", points, points)),
    )


def chosen(shares: Array, which: Array) -> Integers:
    """Return int64[trial]: what float64[trial] unit samples choose, with its share."""
    # the last one takes the remainder of rounding
    ends = np.cumsum(shares)[:-1]
    return np.asarray(np.searchsorted(ends, which, "right"), np.int64)


def better_shares(kind: Integers, gains: Array, number: int, least: float) -> Array:
    """Return float64[kind] shares by the mean gain of each kind's trials.

    `kind` int64[trial] is below `number`; no share is below `least`.
    """
    trials = np.maximum(np.bincount(kind, minlength=number), 1)
    mean = np.bincount(kind, gains, number) / trials
    mean = mean / mean.sum() if mean.any() else np.full(number, 1 / number)
    return np.asarray(least + (1 - number * least) * mean)


class RandomNumbers(NamedTuple):
    """Random numbers of a rare run; seed and streams are as of `Sampler.stages`."""

    seed: int
    streams: Mapping[str, int]

    def unit(self, kind: str, count: int, purpose: str) -> Array:
        """Return float64[count] unit samples that choose a kind of thing."""
        return uniform(self.seed, kind, count, f"of {purpose}")

    def scores(self, trials: int, purpose: str) -> Array:
        """Return float64[trial, stream], independent and standard normal."""
        scores = np.empty((trials, len(self.streams)))
        for column, name in enumerate(self.streams):
            scores[:, column] = ndtri(uniform(self.seed, name, trials, purpose))
        return scores
