"""A response of a run and of its audit: what the audit shows, and what it permits.

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

CENTRAL = 0.16, 0.5, 0.84  # quantiles: half the distance of the outer two is the spread
NEXT_TO = 0.01  # of the deviation and of the room to the limit: the least spread
VISIBLE, OUTLYING = 0.1, 20.0  # of the spread, times the median error: irregular
SETTLED, HALVED = 0.02, 0.5  # of the spread, of the error before: a third one agrees
SAME_SIDE = 0.005  # of the spread: so near a limit an agreeing trial may change sides
DOMINANT = 10.0  # times the spread: the integration decides the numbers, not the parts


class Movement(NamedTuple):
    """How many trials evaluated again moved visibly, and by how much."""

    trials: int  # evaluated again, done both times
    moved: int
    largest: float  # SI
    third: int  # evaluated a third time
    moved_third: int  # of these, that moved again


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
        sides = within(before, self.permitted) != within(
            self.most_precise, self.permitted
        )
        return np.asarray(
            once | moved_again | (sides & (change > SAME_SIDE * self.spread))
        )

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
            len(self.third), int(self.unsettled.sum()),
        )  # fmt: skip

    def permits(self, met: bool, least_out: float, permitted_out: float) -> bool:
        """Return whether a verdict stands beside what the audit shows.

        No verdict does where the third evaluation moves trials again, or errors decide
        the numbers. Beside an irregular error only "not met" may: if the least share
        out of limit, less the greatest part of it that may be within, is not permitted.
        """
        if self.unsettled.any() or self.dominant:
            return False
        if not self.irregular.any():
            return True
        return not met and least_out * (1 - self.most_within) > permitted_out
