"""Independent random samples."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from tolstat.deviations.samplers import Sampler
from tolstat.deviations.streams import random_bits, unit_samples_of


class Random(Sampler):
    """Each name has a stream of its own, numbered by trial.

    A draw depends on the seed, the index of the trial and the name alone: adding a
    contributor, changing a tolerance or asking for more trials leaves every other draw
    as it was.
    """

    extensible = True
    promise = (
        "random trials are independent: order-statistic intervals of quantiles are "
        "exact, and those of fractions out of limit are anytime-valid"
    )

    def unit_samples(
        self, seed: int, streams: Mapping[str, int], trials: int
    ) -> NDArray[np.float64]:
        """Choose unit samples."""
        samples = np.empty((trials, len(streams)))
        for column, name in enumerate(streams):
            samples[:, column] = unit_samples_of(random_bits(seed, name, trials))
        return samples
