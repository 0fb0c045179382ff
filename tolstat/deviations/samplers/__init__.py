"""Ways to choose unit samples, one in each file.

A sampler is a class with one method, `unit_samples(seed, streams, trials)`, and a
sentence, `promise`, on what its samples allow to say about intervals.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

import numpy as np
from numpy.typing import NDArray


class Sampler(Protocol):
    """What every file of this folder holds.

    Attributes
    ----------
    replicates : int
        Number of independent randomisations, trial i belonging to the one of number
        i modulo it; 0 where all trials are independent of each other: only then
        order-statistic and binomial intervals hold.
    extensible : bool
        Whether asking for more trials leaves the first as they were.
    promise : str
        What may be said about intervals, in a sentence.
    """

    replicates: int
    extensible: bool
    promise: str

    def group(self, factors: int) -> int:
        """Return how many trials belong together where so many factors vary.

        The number of trials must be a multiple of it; 1 where each stands alone.
        """
        ...

    def unit_samples(
        self, seed: int, streams: Mapping[str, int], trials: int
    ) -> NDArray[np.float64]:
        """Choose unit samples.

        Parameters
        ----------
        seed : int
            Of the study.
        streams : mapping of str to int
            The names to sample for, each with its fixed number among all names of the
            model.
        trials : int
            How many, numbered from 0.

        Returns
        -------
        float64[trial, stream]
            Above 0 and below 1, in the order of `streams`.
        """
        ...
