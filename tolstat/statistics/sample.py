"""The trials of a run."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.arrays import Integers, Truths
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.intervals.replicates import share_from_replicates
from tolstat.statistics.intervals.shares import anytime_valid, proportion
from tolstat.statistics.intervals.weighted_estimates import weighted_share
from tolstat.statistics.intervals.weights import Weights
from tolstat.status import Status


class Sample(NamedTuple):
    """The trials of a run, for all its responses."""

    status: NDArray[np.integer]  # int[trial]: values of `Status`
    replicates: int = 0  # replicates of the sampling; 0 if the trials are independent
    # trials of the run for each trial of the sample: above 1 in a run for Sobol'
    # indices
    each: float = 1.0
    # given if trials stand for units of other distributions; all trials have run
    weights: Weights | None = None

    @property
    def done(self) -> Truths:
        """Which trials are done."""
        found: Truths = self.status == Status.DONE
        return found

    @property
    def ran(self) -> Truths:
        """Which trials have run, failed ones included."""
        found: Truths = self.status != Status.NOT_RUN
        return found

    @property
    def failed(self) -> int:
        """Number of the trials that ran and failed."""
        return int(np.count_nonzero(self.ran) - np.count_nonzero(self.done))

    @property
    def replicate(self) -> Integers:
        """Randomisation number of each trial: int64[trial]."""
        return np.arange(len(self.status)) % max(self.replicates, 1)

    def share(
        self,
        units: Truths,
        among: Truths,
        counted: Callable[[int, int], Estimate] = anytime_valid,
    ) -> Estimate:
        """Estimate the share of units with a property among some of the trials.

        `counted` estimates a share from a count and a number of independent trials.
        """
        units = units[among]
        if self.replicates:
            return share_from_replicates(units, self.replicate[among])
        if self.weights:
            return weighted_share(units, self.weights.of(among))
        return counted(int(np.count_nonzero(units)), len(units))

    def weights_of(self, trials: Truths) -> Weights | None:
        """Return the weights of the trials that bool[trial] selects."""
        return self.weights and self.weights.of(trials)

    def first(self, trials: int) -> Sample:
        """Return the first trials."""
        return self._replace(status=self.status[:trials])

    @property
    def failures(self) -> Estimate:
        """Share of the trials that ran and failed."""
        if not self.ran.any():
            return Estimate(math.nan, reason="no trial has run")
        return self.share(~self.done, self.ran, proportion)
