"""A normal distribution for out-of-limit trials in many directions."""

import math
from collections.abc import Sequence

import numpy as np

from tolstat.arrays import Array
from tolstat.deviations.mixture import Mixture, roomy

AXES, SPECIAL = 15, 1.5  # principal axes tried at either end; ratio of variances
LEAST = 0.1  # common variance


def normal_of(halves: Sequence[Array]) -> Mixture:
    """Return a normal distribution, and a wider one about the same mean.

    They are fitted to two independent float64[trial, direction]. Coordinates of the
    mean shrink by twice their variance (L. Breiman, Technometrics 37 (1995) 373-384),
    which the distance of the two means tells. All directions share one variance. A
    principal axis of the first half has its own if its variance in the second half
    differs by more than the factor `SPECIAL`.
    """
    mean_1, mean_2 = (half.mean(axis=0) for half in halves)
    first, second = (half - half.mean(axis=0) for half in halves)
    n, d = len(first) + len(second), first.shape[1]
    chance = float(((mean_1 - mean_2) ** 2).sum()) / (4 * d)
    mean = (mean_1 + mean_2) / 2
    mean = mean * np.maximum(1 - 2 * chance / np.maximum(mean**2, 1e-300), 0.0)
    total = float((first**2).sum() + (second**2).sum()) / n + d * chance
    vectors = np.linalg.eigh(np.einsum("ni,nj->ij", first, first))[1].T
    axes = np.concatenate([vectors[:AXES], vectors[max(AXES, d - AXES) :]])
    variances = (np.einsum("ni,ai->na", second, axes) ** 2).mean(axis=0)
    ratio = variances * d / max(total, LEAST)
    axes = axes[(ratio > SPECIAL) | (ratio < 1 / SPECIAL)]
    away = np.concatenate([first, second])
    along = (np.einsum("ni,ai->na", away, axes) ** 2).mean(axis=0)
    common = np.array(max((total - along.sum()) / max(d - len(axes), 1), LEAST))
    more = roomy(along) - roomy(common)
    covariance = roomy(common) * np.eye(d) + np.einsum("a,ai,aj->ij", more, axes, axes)
    root = np.linalg.cholesky(covariance)
    wider = math.sqrt(1 + 1.5 / math.sqrt(d))
    return Mixture(
        np.array([0.6, 0.4]), np.array([mean, mean]), np.array([root, wider * root])
    )
