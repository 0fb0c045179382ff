"""Trials of a rare run that are drawn at once, in the space of normal scores."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, ndtri

from tolstat.deviations.streams import random_bits, unit_samples_of

Array = NDArray[np.float64]

LEAST_UNIT = 2.0**-53


class Stage(NamedTuple):
    """Trials that are drawn at once.

    Attributes
    ----------
    unit : float64[trial, stream]
        Independent unit samples of machines.
    spread : float64[trial]
        Times the spread of the study that was aimed at.
    distance : float64[trial]
        From the middle machine, in normal scores: the likelier the nearer.
    weight : float64[trial]
        Density of each as the study has it over that as it was drawn; NaN where
        machines were only sought.
    """

    unit: Array
    spread: Array
    distance: Array
    weight: Array


def stage_of(points: Array, spread: Array | float, weight: Array | float) -> Stage:
    """Return the trials that lie at some points.

    Parameters
    ----------
    points : float64[trial, stream]
        Normal scores.
    spread, weight : float64[trial] or float
        See `Stage`.
    """
    n = len(points)
    return Stage(
        np.clip(np.asarray(ndtr(points)), LEAST_UNIT, 1 - LEAST_UNIT),
        np.broadcast_to(np.asarray(spread, np.float64), n),
        np.sqrt(np.einsum("ni,ni->n", points, points)),
        np.broadcast_to(np.asarray(weight, np.float64), n),
    )


def beside_each_other(stages: Sequence[Stage]) -> Stage:
    """Return several stages as one."""
    return Stage(*map(np.concatenate, zip(*stages, strict=True)))


def unit_samples(seed: int, name: str, trials: int, purpose: str) -> Array:
    """Draw numbers between 0 and 1 that belong to a name, and to a purpose of it."""
    return unit_samples_of(random_bits(seed, name, trials, purpose))


def normal_scores(
    seed: int, streams: Mapping[str, int], trials: int, purpose: str
) -> Array:
    """Draw float64[trial, stream], independent and standard normal."""
    scores = np.empty((trials, len(streams)))
    for column, name in enumerate(streams):
        scores[:, column] = ndtri(unit_samples(seed, name, trials, purpose))
    return scores
