"""Integration errors, and their effect on statistics and verdicts."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array, Integers, Truths
from tolstat.statistics.limits.limit import within


class IntegrationError(NamedTuple):
    """Errors of a response in the trials that were integrated again.

    Attributes
    ----------
    trials : int64[n]
        Trials that are done in both integrations.
    errors : float64[n]
        Stored response less the precise one.
    representative : bool[n]
        Whether a trial represents those of similar response that were not integrated
        again.
    failed : int
        Trials left out because they failed in one of the two integrations.
    """

    trials: Integers
    errors: Array
    representative: Truths
    failed: int

    @property
    def largest(self) -> float:
        """Largest absolute error, no bound for other trials; NaN if there is none."""
        return float(np.abs(self.errors).max()) if len(self.errors) else math.nan

    def of(self, trials: Integers) -> IntegrationError:
        """Return the errors of given trials only."""
        some = np.isin(self.trials, trials)
        return IntegrationError(
            self.trials[some], self.errors[some], self.representative[some], 0
        )

    def removed(self, values: Array) -> Array:
        """Return float64[trial], the response without its integration error.

        Trials that were integrated again have their precise value. Other trials lose
        the error of the representative trial of nearest response. Representative trials
        of equal response take turns: each counts for as many trials as it represents.
        """
        if not self.representative.any():
            return np.full_like(values, np.nan)
        levels = self._levels(values)
        nearest = np.searchsorted((levels[1:] + levels[:-1]) / 2, values)
        found = values - self._of_level(nearest, values)
        found[self.trials] = values[self.trials] - self.errors
        return np.asarray(found)

    def size(self, values: Array) -> Array:
        """Return float64[trial], how large the integration error of a response may be.

        Trials that were not integrated again err by as much as the worse of the two
        representative trials whose responses are next to theirs, below and above. It is
        infinite where none is representative.
        """
        if not self.representative.any():
            return np.full_like(values, np.inf)
        levels = self._levels(values)
        below = np.searchsorted(levels, values, side="right") - 1
        above = np.searchsorted(levels, values).clip(max=len(levels) - 1)
        errors = [self._of_level(at, values) for at in (below.clip(0), above)]
        return np.asarray(np.abs(errors).max(axis=0))

    def _levels(self, values: Array) -> Array:
        """Return the responses of representative trials, each once, ascending."""
        return np.unique(values[self.trials[self.representative]])

    def _of_level(self, level: Integers, values: Array) -> Array:
        """Return the error of a representative trial of each trial's level.

        Those of equal response take turns.
        """
        known = values[self.trials[self.representative]]
        order = np.argsort(known, kind="stable")
        _, first, equal = np.unique(known[order], return_index=True, return_counts=True)
        turn = _turns(level) % equal[level]
        return np.asarray(self.errors[self.representative][order[first[level] + turn]])


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
    representative : bool[n]
        Whether a trial represents trials of similar response: chosen at random or by
        this response. A trial chosen by another response may be unusual among these.
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
) -> tuple[Array, Array]:
    """Return the least and the largest response that integration errors allow.

    Trials that were integrated again have their precise response. Others err up or down
    by `IntegrationError.size`. A trial that is done once only may have any response,
    and so may those that it represents.

    Returns
    -------
    tuple of float64[trial]
        NaN for trials that fail both times, and those that they represent.
    """
    errors = values[trials] - precise
    once = np.isfinite(values[trials]) & np.isnan(precise)
    errors[once] = np.inf
    known = ~np.isnan(errors)
    found = IntegrationError(trials[known], errors[known], representative[known], 0)
    size = found.size(values)
    if np.any(np.isnan(values[trials]) & np.isfinite(precise) & representative):
        size = np.where(np.isnan(values), np.inf, size)  # others may be done as well
        values = np.nan_to_num(values)
    least, largest = values - size, values + size
    least[trials] = np.where(once, -np.inf, precise)
    largest[trials] = np.where(once, np.inf, precise)
    return least, largest


class VerdictChanges(NamedTuple):
    """The effect of integration errors on the share of units out of limit.

    Attributes
    ----------
    near : int
        Trials integrated again that are nearer to the limit than all others.
    changed : int
        Trials integrated again that are within the limit in one integration only.
    gap : float
        Distance from the limit to the nearest trial that was not integrated again.
        If the errors of such trials are smaller, only `changed` trials change sides.
        Infinite if there is none.
    at_most : float
        Greatest change of the share out of limit then: `changed` over all trials done.
    """

    near: int
    changed: int
    gap: float
    at_most: float


def verdict_changes(
    values: Array,
    trials: Integers,
    precise: Array,
    limit: tuple[float, float],
) -> VerdictChanges:
    """Count the trials that change sides of a limit.

    Parameters
    ----------
    trials : int64[n]
        Trials that are done in both integrations.
    precise : float64[n]
        Their precise response.
    """
    lower, upper = limit
    distance = np.fmin(np.abs(values - lower), np.abs(values - upper))
    others = np.isfinite(values)
    done = int(np.count_nonzero(others))
    others[trials] = False
    gap = float(distance[others].min()) if others.any() else math.inf
    near = int(np.count_nonzero(distance[trials] < gap))
    before, after = within(values[trials], limit), within(precise, limit)
    changed = int(np.count_nonzero(before != after))
    return VerdictChanges(near, changed, gap, changed / done if done else math.nan)
