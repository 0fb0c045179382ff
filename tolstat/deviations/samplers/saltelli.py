"""Saltelli's design: trials in groups that differ by one factor, for Sobol' indices."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from tolstat.deviations.samplers import Sampler
from tolstat.deviations.streams import random_bits, unit_samples_of

OWN = 2  # the first trials of a group, A and B, are independent random trials


class Saltelli(Sampler):
    """Groups of k + 2 trials: A and B, then A with one of k factors from B.

    Trial i is number i % (k + 2) of group i // (k + 2). A draw depends on the seed, the
    name, the group and which names vary.

    References
    ----------
    A. Saltelli et al., Variance based sensitivity analysis of model output, Computer
    Physics Communications 181 (2010) 259-270, the radial design of table 2.
    """

    promise = (
        "Saltelli's design: the first two trials of each group are independent, and "
        "quantiles and shares rest on these alone, with exact intervals; all of them "
        "together give the Sobol' indices"
    )

    def group(self, factors: int) -> int:
        """Return how many trials belong together."""
        return factors + OWN

    def unfit(self, trials: int, factors: int) -> str:
        """Say why a number of trials does not fit: it holds whole groups."""
        group = self.group(factors)
        if trials % group == 0:
            return ""
        below = trials // group * group
        near = " or ".join(str(n) for n in (below, below + group) if n)
        return (
            f"a multiple of {group} is expected, {factors} contributors that deviate "
            f"and {OWN} for each point: {near}"
        )

    def unit_samples(
        self, seed: int, streams: Mapping[str, int], trials: int
    ) -> NDArray[np.float64]:
        """Choose unit samples."""
        group = self.group(len(streams))
        points = math.ceil(trials / group)
        samples = np.empty((points, group, len(streams)))
        for column, name in enumerate(streams):
            a, b = (
                unit_samples_of(random_bits(seed, name, points, f"saltelli {which}"))
                for which in "AB"
            )
            samples[:, :, column] = a[:, None]
            samples[:, 1, column] = b
            samples[:, OWN + column, column] = b
        return samples.reshape(points * group, len(streams))[:trials]
