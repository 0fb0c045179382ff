"""Latin hypercube: every contributor's range is covered evenly."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from tolstat.deviations.streams import random_bits, unit_samples_of

BELOW_ONE = 1 - 2.0**-53


class Latin:
    """One sample of each name in each of N strips of equal probability.

    A draw depends on the seed, the name, the index and the number of trials: another
    number is another sample.

    References
    ----------
    M. D. McKay, R. J. Beckman, W. J. Conover, Technometrics 21 (1979) 239-245.
    """

    independent = False
    promise = (
        "Latin hypercube trials depend on each other: averages are at least nearly as "
        "good as of random trials, often better, but one sample bears no interval; "
        "repeat it with other seeds and compare"
    )

    def unit_samples(
        self, seed: int, streams: Mapping[str, int], trials: int
    ) -> NDArray[np.float64]:
        """Choose unit samples; see `Sampler`."""
        samples = np.empty((trials, len(streams)))
        for column, name in enumerate(streams):
            order = random_bits(seed, name, trials, f"latin order {trials}")
            strip = np.argsort(order, kind="stable")
            within = unit_samples_of(
                random_bits(seed, name, trials, f"latin place {trials}")
            )
            samples[:, column] = (strip + within) / trials
        return np.minimum(samples, BELOW_ONE)  # the last strip may round up to 1
