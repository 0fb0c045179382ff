"""Integration errors: what an audit shows, and which verdicts it permits.

Three evaluations are compared: that of the run, that of the audit, and a third one,
tighter still, of a few audited trials. An error is judged beside the spread of the
response. One that stands out from the others is of an event that the steps missed:
trials that were not evaluated again may hide as large a one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array, Integers, Truths
from tolstat.statistics.intervals.shares import proportion
from tolstat.statistics.limits.limit import within


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

    def selected(self, trials: Integers) -> IntegrationError:
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
        errors = self.errors[self.representative]
        corrected = values - errors[order[first[nearest] + turn]]
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
    both = ~np.isnan(errors)
    error = IntegrationError(trials[both], errors[both], representative[both], 0)
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


CENTRAL = 0.16, 0.5, 0.84  # quantiles: half the distance of the outer two is the spread
NEXT_TO = 0.01  # of the deviation and of the room to the limit: the least spread
VISIBLE, OUTLYING = 0.1, 20.0  # of the spread, times the median error: irregular
SETTLED, HALVED = 0.02, 0.5  # of the spread, of the error before: a third one agrees
SAME_SIDE = 0.005  # of the spread: so near a limit an agreeing trial may change sides
JUMPED_OVER = 1e5  # of rtol, inside a step: something that steps did not see
GROWTH = 2.0  # from each evaluation of all trials to the next, at shorter steps
DOMINANT = 10.0  # times the spread: the integration decides the numbers, not the parts


def grows(*evaluations: Array) -> bool:
    """Return whether each evaluation at least doubles all trials of the one before.

    Steps are shorter each time: the response counts them, or it does not converge.
    """
    sizes = np.abs(evaluations)
    doubled = sizes[1:] >= GROWTH * sizes[:-1]
    return bool(sizes.size and sizes[0].all() and doubled.all())


class Movement(NamedTuple):
    """How many trials evaluated again moved visibly, and by how much."""

    trials: int  # evaluated again, done both times
    moved: int
    largest: float  # SI
    third: int  # evaluated a third time
    moved_third: int  # of these, that moved again
    jumped_over: bool  # whether rates were seen to jump inside steps
    failed_again: int  # trials that are done, and failed when evaluated again
    failed_before: int  # trials that failed, and did not when evaluated again


@dataclass(frozen=True)
class AuditedResponse:
    """A response in all trials, SI, and in those evaluated again."""

    values: Array  # float64[trial], as stored, NaN in failed trials
    permitted: tuple[float, float]  # its limit, infinite ends without one
    trials: Integers  # int64[n], ascending
    precise: Array  # float64[n]
    at_random: Truths  # bool[n]: of all trials
    out: Truths  # bool[n]: chosen at random among the trials out of limit
    third: Integers  # int64[m]: which of the n were evaluated a third time
    most_precise: Array  # float64[m]
    residual: float = 0.0  # of rtol: largest difference of rates inside a step

    @property
    def errors(self) -> Array:
        """Absolute errors, float64[n]; NaN of trials that failed one of both times."""
        return np.asarray(np.abs(self.values[self.trials] - self.precise))

    @property
    def median(self) -> float:
        """The median error; 0 if none is known."""
        finite = self.errors[np.isfinite(self.errors)]
        return float(np.median(finite)) if len(finite) else 0.0

    @cached_property
    def spread(self) -> float:
        """The size beside which an error counts: half the central 68 %.

        Where that is nearly nothing, a hundredth of the standard deviation, or of the
        room between median and limit; NaN if no trial is done.
        """
        done = self.values[np.isfinite(self.values)]
        if not len(done):
            return math.nan
        low, middle, high = np.quantile(done, CENTRAL)
        ends = np.array(self.permitted)
        room = np.abs(middle - ends[np.isfinite(ends)]).min(initial=np.inf)
        least = max(float(done.std()), float(room) if np.isfinite(room) else 0.0)
        return max(float(high - low) / 2, NEXT_TO * least)

    @property
    def moved(self) -> Truths:
        """Which trials moved visibly, bool[n]."""
        return np.asarray(self.errors > VISIBLE * self.spread)

    @property
    def irregular(self) -> Truths:
        """Which errors stand out from the others, bool[n]."""
        return self.moved & (self.errors > OUTLYING * self.median)

    @property
    def unsettled(self) -> Truths:
        """Which trials the third evaluation moves again, bool[m]."""
        before = self.precise[self.third]
        change = np.abs(before - self.most_precise)
        once = np.isnan(before) != np.isnan(self.most_precise)
        error = np.fmax(self.errors[self.third], self.median)
        moved_again = change > np.fmax(SETTLED * self.spread, HALVED * error)
        evaluations = before, self.most_precise
        inside, still_inside = (within(x, self.permitted) for x in evaluations)
        crosses = (inside != still_inside) & (change > SAME_SIDE * self.spread)
        return np.asarray(once | moved_again | crosses)

    @property
    def jumped_over(self) -> bool:
        """Whether steps jumped over something, in any trial."""
        return self.residual > JUMPED_OVER

    @property
    def grows(self) -> bool:
        """Whether it at least doubles with each evaluation, at shorter steps."""
        before = self.values[self.trials[self.third]], self.precise[self.third]
        return grows(*before, self.most_precise)

    @property
    def dominant(self) -> bool:
        """Whether the usual error is far above the spread: the numbers are its own."""
        return self.median > DOMINANT * self.spread

    @property
    def most_within(self) -> float:
        """The greatest share of the trials out of limit that may be within."""
        inside = within(self.precise[self.out], self.permitted)
        number = len(inside)
        return proportion(int(inside.sum()), number).upper if number else 1.0

    @property
    def movement(self) -> Movement:
        """How many trials moved, and by how much."""
        finite = self.errors[np.isfinite(self.errors)]
        again = np.abs(self.precise[self.third] - self.most_precise)
        finite_third = again[np.isfinite(again)]
        largest = np.concatenate([finite, finite_third]).max(initial=0.0)
        return Movement(
            len(finite), int(self.moved.sum()), float(largest),
            len(self.third), int(self.unsettled.sum()), self.jumped_over,
            *map(int, self._failed_once.sum(axis=1)),
        )  # fmt: skip

    @property
    def _failed_once(self) -> Truths:
        """Which trials failed the second time alone, or the first; bool[2, n]."""
        first, second = np.isnan(self.values[self.trials]), np.isnan(self.precise)
        return np.stack([second & ~first, first & ~second])

    @property
    def only_failures(self) -> bool:
        """Whether trials fail only when evaluated again, and nothing else is wrong.

        Those that fail in the run alone fail by too rough an integration.
        """
        both = np.isfinite(self.precise[self.third]) & np.isfinite(self.most_precise)
        wrong = bool(self.moved.any() or (self.unsettled & both).any())
        wrong = wrong or self.jumped_over or self.dominant
        again, before = (bool(trials.any()) for trials in self._failed_once)
        return again and not (before or wrong)

    def permits(self, met: bool, least_out: float, permitted_out: float) -> bool:
        """Return whether a verdict stands beside what the audit shows.

        No verdict does where the third evaluation moves trials again, steps jumped over
        something, or errors decide the numbers. Beside an irregular error only "not
        met" may: if the least share out of limit, less the greatest part of it that may
        be within, is not permitted.
        """
        if self.unsettled.any() or self.dominant or self.jumped_over:
            return False
        if not self.irregular.any():
            return True
        return not met and least_out * (1 - self.most_within) > permitted_out
