"""The second error bar: how far integration errors move the numbers."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]


class IntegrationError(NamedTuple):
    """Errors of a response in the trials that were integrated again.

    Attributes
    ----------
    trials : int64[n]
        Which trials, all of them done both times.
    errors : float64[n]
        Stored response less the precise one.
    alike : bool[n]
        Whether a trial can stand for those of like response that were not integrated
        again.
    failed : int
        Trials that were left out because they failed one of the two times.
    """

    trials: NDArray[np.int64]
    errors: Array
    alike: Flags
    failed: int

    @property
    def largest(self) -> float:
        """Largest absolute error; NaN if there is none. It bounds no other trial's."""
        return float(np.abs(self.errors).max()) if len(self.errors) else math.nan

    def of(self, trials: NDArray[np.int64]) -> IntegrationError:
        """Return the errors of those that are among given trials, none left out."""
        some = np.isin(self.trials, trials)
        return IntegrationError(
            self.trials[some], self.errors[some], self.alike[some], 0
        )

    def removed(self, values: Array) -> Array:
        """Return the response as precise integration would have found it.

        Parameters
        ----------
        values : float64[trial]
            The response; NaN in trials that are not done.

        Returns
        -------
        float64[trial]
            Precise in the trials integrated again. Any other less the error of that
            one, of those that can stand for others, whose response is nearest to its
            own; where several are equally near because they are equal, these take
            turns. Where trials were chosen by the response, each so counts for
            as many as it stands for, and not for as often as its kind was chosen.
        """
        if not self.alike.any():
            return np.full_like(values, np.nan)
        known = values[self.trials[self.alike]]
        order = np.argsort(known, kind="stable")
        levels, first, equal = np.unique(
            known[order], return_index=True, return_counts=True
        )
        nearest = np.searchsorted((levels[1:] + levels[:-1]) / 2, values)
        turn = _turns(nearest) % equal[nearest]
        found = values - self.errors[self.alike][order[first[nearest] + turn]]
        found[self.trials] = values[self.trials] - self.errors
        return np.asarray(found)


def _turns(groups: NDArray[np.int64]) -> NDArray[np.int64]:
    """Count, for each element, the ones before it in its group."""
    order = np.argsort(groups, kind="stable")
    ascending = groups[order]
    turns = np.empty_like(order)
    turns[order] = np.arange(len(groups)) - np.searchsorted(ascending, ascending)
    return turns


def integration_error(
    values: Array, trials: NDArray[np.int64], precise: Array, alike: Flags
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
    alike : bool[n]
        Whether a trial can stand for those of like response: it was chosen at random,
        or by this response, and not by another one's values, which may choose what is
        rare among its likes.
    """
    errors = values[trials] - precise
    done = np.isfinite(errors)
    failed = int(np.count_nonzero(~done))
    return IntegrationError(trials[done], errors[done], alike[done], failed)


def share_above_largest(trials: int, confidence: float = 0.95) -> float:
    """Bound how many machines exceed the largest of some random ones.

    Parameters
    ----------
    trials : int
        Independent ones, of which the largest is taken.
    confidence : float
        Of the bound.

    Returns
    -------
    float
        Share of all machines that is exceeded at most: exact for a continuous
        distribution, conservative for one with atoms; NaN without trials.
    """
    return 1 - (1 - confidence) ** (1 / trials) if trials else math.nan
