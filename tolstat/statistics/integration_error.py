"""The second error bar: how far integration errors move the numbers."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class IntegrationError(NamedTuple):
    """Errors of the trials that were integrated again.

    Attributes
    ----------
    trials : int64[n]
        Which trials, all of them done both times.
    errors : float64[n]
        Stored response less the precise one.
    failed : int
        Trials that were left out because they failed one of the two times.
    """

    trials: NDArray[np.int64]
    errors: Array
    failed: int

    @property
    def largest(self) -> float:
        """Largest absolute error; NaN if there is none."""
        return float(np.abs(self.errors).max()) if len(self.errors) else float("nan")

    def removed(self, values: Array) -> Array:
        """Return the response as precise integration would have found it.

        Parameters
        ----------
        values : float64[trial]
            The response; NaN in trials that are not done.

        Returns
        -------
        float64[trial]
            Each less the error of that trial, among those integrated again, whose
            response is nearest to its own.
        """
        if not len(self.errors):
            return np.full_like(values, np.nan)
        known = values[self.trials]
        order = np.argsort(known, kind="stable")
        middles = (known[order][1:] + known[order][:-1]) / 2
        nearest = np.searchsorted(middles, values)
        return np.asarray(values - self.errors[order][nearest])


def integration_error(
    values: Array, trials: NDArray[np.int64], precise: Array
) -> IntegrationError:
    """Compare a response with the same trials integrated precisely.

    Parameters
    ----------
    values : float64[trial]
        The response; NaN in trials that are not done.
    trials : int64[n]
        Which of them were integrated again.
    precise : float64[n]
        What was found then; NaN where that failed.
    """
    errors = values[trials] - precise
    done = np.isfinite(errors)
    return IntegrationError(trials[done], errors[done], int(np.count_nonzero(~done)))
