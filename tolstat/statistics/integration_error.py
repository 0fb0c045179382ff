"""Integration errors, and their effect on statistics and verdicts."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array, Integers, Truths


class IntegrationError(NamedTuple):
    """Errors of a response in the trials that were integrated again."""

    trials: Integers  # int64[n]: trials that are done in both integrations
    errors: Array  # float64[n]: stored response less the precise one
    # bool[n]: whether a trial represents those of similar response that were not
    # integrated again
    representative: Truths
    failed: int  # trials left out because they failed in one of the two integrations

    @property
    def largest(self) -> float:
        """Largest absolute error, no bound for other trials; NaN if there is none."""
        return float(np.abs(self.errors).max()) if len(self.errors) else math.nan

    def of(self, trials: Integers) -> IntegrationError:
        """Return the errors of given trials only."""
        chosen = np.isin(self.trials, trials)
        return IntegrationError(
            self.trials[chosen], self.errors[chosen], self.representative[chosen], 0
        )

    def removed(self, values: Array) -> Array:
        """Return float64[trial], the response without its integration error.

        Trials that were integrated again have their precise value. Other trials lose
        the error of the representative trial of nearest response. Representative trials
        of equal response take turns: each counts for as many trials as it represents.
        """
        if not self.representative.any():
            return np.full_like(values, np.nan)
        responses = values[self.trials[self.representative]]
        order = np.argsort(responses, kind="stable")
        levels, first, equal = np.unique(
            responses[order], return_index=True, return_counts=True
        )
        nearest = np.searchsorted((levels[1:] + levels[:-1]) / 2, values)
        turn = _turns(nearest) % equal[nearest]
        corrected = (
            values - self.errors[self.representative][order[first[nearest] + turn]]
        )
        corrected[self.trials] = values[self.trials] - self.errors
        return np.asarray(corrected)


def _turns(groups: Integers) -> Integers:
    """Count, for each element, the earlier ones of its group."""
    order = np.argsort(groups, kind="stable")
    ascending = groups[order]
    turns = np.empty_like(order)
    turns[order] = np.arange(len(groups)) - np.searchsorted(ascending, ascending)
    return turns


def integration_error(
    values: Array, trials: Integers, precise: Array, representative: Truths
) -> IntegrationError:
    """Compare a response with the same trials integrated precisely.

    Parameters
    ----------
    values : float64[trial]
        The response as stored, NaN in failed trials.
    trials, precise : int64[n], float64[n]
        The trials that were integrated again, and their precise responses.
    representative : bool[n]
        Which of these represent trials of similar response: chosen at random or by this
        response. A trial chosen by another response may be unusual.
    """
    errors = values[trials] - precise
    done = np.isfinite(errors)
    failed = int(np.count_nonzero(~done))
    return IntegrationError(trials[done], errors[done], representative[done], failed)


def share_above_largest(trials: int) -> float:
    """Return the greatest share of units above the largest of independent trials.

    With 95 % confidence: exact for a continuous distribution, conservative for one with
    point masses; NaN without trials.
    """
    return 1 - (1 - 0.95) ** (1 / trials) if trials else math.nan


def response_ends(
    values: Array, trials: Integers, precise: Array, representative: Truths
) -> Array:
    """Return float64[end, trial], the range of responses that integration errors allow.

    Trials that were integrated again have their precise response. Others err up or down
    by as much as the worst of the representative trials of nearest response, and of
    those next below and above. A trial that failed in one integration only may have any
    response, and so may those that it represents. NaN where both integrations failed.
    """
    errors = values[trials] - precise
    once = np.isfinite(values[trials]) & np.isnan(precise)
    errors[once] = np.inf
    comparable = ~np.isnan(errors)
    error = IntegrationError(
        trials[comparable], errors[comparable], representative[comparable], 0
    )
    size = np.nan_to_num(np.abs(values - error.removed(values)), nan=np.inf)
    audited = error.trials[error.representative]
    order = np.argsort(values[audited])
    levels, sizes = values[audited][order], np.abs(error.errors[error.representative])
    between = ~np.isin(values, levels) & bool(len(levels))
    for level in np.searchsorted(levels, values[between]) - [[1], [0]]:
        neighbours = sizes[order][level.clip(0, len(levels) - 1)]
        size[between] = np.maximum(size[between], neighbours)
    if np.any(np.isnan(values[trials]) & np.isfinite(precise) & representative):
        values = np.nan_to_num(values)  # other failed trials may be done as well
    ends = np.stack([values - size, values + size])
    ends[:, trials] = np.where(once, [[-np.inf], [np.inf]], precise)
    return ends
