"""Latin hypercube: every contributor's range is covered evenly."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from tolstat.deviations.samplers import Sampler
from tolstat.deviations.streams import random_bits, unit_samples_of

REPLICATES = 16
BELOW_ONE = 1 - 2.0**-53


class Latin(Sampler):
    """Sixteen Latin hypercubes, independent of each other: trial i is of number i % 16.

    In each, one sample of each name lies in each of n strips of equal probability. A
    draw depends on the seed, the name, the index and the number of trials: another
    number is another sample.

    References
    ----------
    M. D. McKay, R. J. Beckman, W. J. Conover, Technometrics 21 (1979) 239-245.
    """

    replicates = REPLICATES
    promise = (
        "Latin hypercube trials depend on each other: averages are at least nearly as "
        "good as of random trials, often better; intervals come from the scatter "
        "between 16 independent hypercubes and are approximate"
    )

    def unit_samples(
        self, seed: int, streams: Mapping[str, int], trials: int
    ) -> NDArray[np.float64]:
        """Choose unit samples."""
        samples = np.empty((trials, len(streams)))
        for column, name in enumerate(streams):
            for replicate in range(min(REPLICATES, trials)):
                n = len(range(replicate, trials, REPLICATES))
                purpose = f"latin {replicate} of {n}"
                order = random_bits(seed, name, n, f"{purpose}: order")
                strip = np.argsort(order, kind="stable")
                within = unit_samples_of(
                    random_bits(seed, name, n, f"{purpose}: place")
                )
                samples[replicate::REPLICATES, column] = (strip + within) / n
        return np.minimum(samples, BELOW_ONE)  # the last strip may round up to 1
