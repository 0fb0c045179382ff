"""Stored trials that move with a change of contributors."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum
from functools import cached_property, partial

import numpy as np
from scipy.special import ndtri

from tolstat.arrays import Array, Truths
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.intervals.shares import proportion
from tolstat.statistics.limits.limit import Limit, rounded_out
from tolstat.statistics.remedies.change import Change, Design
from tolstat.statistics.remedies.surface import Surface, fitted_surface
from tolstat.statistics.sample import Sample

LEAST_TRIALS = 200
MOST_FITTED = 16_384  # trials of a surface: more tell its slopes hardly better
DEEP, DEEPEST = 10.0, 0.02  # trials in the tail that shows the spread; its most
POINT_MASS = 1e-9  # of the room to a limit: a tail without any spread
WEIGHTED = "inverted_cdf"  # quantiles, the only ones that NumPy knows
RAREST = 1e-9  # permitted trials, where as many fail as are permitted


class NoRemedy(Enum):
    """Why no remedy is searched; the value is the sentence."""

    LIMITS = "no response has a limit"
    FREE = "all contributors are fixed"
    WEIGHTED = "trials of a rare run are weighted"
    TRIALS = f"needs {LEAST_TRIALS} trials that are done"
    FAILED = "none is sought while more trials fail than a limit permits out of it"


@dataclass(frozen=True)
class MovableTrials:
    """Trials that are done, and the limits of their responses.

    Attributes
    ----------
    z : float64[trial, contributor]
        Deviations from their centres, over half the tolerance.
    responses : float64[trial, response]
        SI.
    failed : float
        Trials that failed: out of all limits, whatever changes. As `units`.
    permitted : float64[response, end]
        Infinite where an end is open.
    permitted_out : float64[response]
        The permitted share out of limit.
    units : float64[trial], optional
        Drawn trials that each stands for; 1 if not given.
    thinned : Sample, optional
        Failed trials included, if trials were thinned: intervals need its stages.
    """

    z: Array
    responses: Array
    failed: float
    permitted: Array
    permitted_out: Array
    design: Design
    surface: Surface
    units: Array | None = None
    thinned: Sample | None = None

    def at_most(self, most: int) -> MovableTrials:
        """Return so many of the trials at most, with the surface of all."""
        chosen = slice(None, None, -(-len(self.z) // most))
        z, responses = self.z[chosen], self.responses[chosen]
        units = None if self.units is None else self.units[chosen]
        failed = round(self.failed * len(z) / len(self.z))
        return replace(self, z=z, responses=responses, failed=failed, units=units)

    @property
    def done(self) -> float:
        """Number of the trials, as `units`."""
        return len(self.z) if self.units is None else float(self.units.sum())

    @property
    def all_had_chances(self) -> bool:
        """Whether no drawn trial was left out because it was far from all limits."""
        thinned = self.thinned and self.thinned.thinned
        return not (thinned and thinned.skips)

    def out_of(self, trials: Truths) -> float:
        """Return the number of some of the trials, as `units`, with the failed ones."""
        if self.units is None:
            return int(np.count_nonzero(trials)) + self.failed
        return float(self.units[trials].sum()) + self.failed

    def share(self, out: Truths, permitted: float) -> Estimate:
        """Estimate the share of bool[trial] and the failed ones, for such a limit."""
        if self.thinned is None:
            return proportion(self.out_of(out), self.done + self.failed)
        units, part = self.thinned.failed_trials, self.thinned.telling(permitted)
        units[self.thinned.done] = out
        share = part.share(units[: len(part.status)], part.ran)
        if not part.thinned or not part.thinned.skips:
            return share
        # those without a chance may move out of limit: others would show many
        covering = self.share(out, 1.0)
        return covering if covering.lower > share.upper else share

    def sampled_again(
        self, change: Change, deviations: Array, responses: Array
    ) -> MovableTrials:
        """Return fresh trials of the changed design; NaN in failed ones."""
        design = self.design.changed(change)
        done = np.isfinite(responses).all(axis=1)
        z, y = design.scaled(deviations[done]), responses[done]
        failed = int(np.count_nonzero(~done))
        return replace(
            self, z=z, responses=y, failed=failed, design=design,
            surface=_surface(z, y), units=None, thinned=None,
        )  # fmt: skip

    def moved(self, change: Change) -> Moved:
        """Move all trials by a change."""
        return Moved(self, self.design.none, self.responses).moved(change)


@dataclass(frozen=True)
class Moved:
    """Trials after a change."""

    origin: MovableTrials
    change: Change
    responses: Array  # float64[trial, response]

    @cached_property
    def z(self) -> Array:
        """Deviations in the scale of the origin, float64[trial, contributor]."""
        shift, ratio = self.origin.design.members(self.change)
        return np.asarray(shift + ratio * self.origin.z)

    def moved(self, change: Change) -> Moved:
        """Move all trials on, to another change of the origin."""
        ratio = change.ratio / self.change.ratio
        shift = change.shift - ratio * self.change.shift
        members = self.origin.design.members(Change(shift, ratio))
        gains = self.origin.surface.change(self.z, *members)
        return Moved(self.origin, change, self.responses + gains)

    @property
    def _tails(self) -> Array:
        """The share of trials in the tails that show the spread, float64[response]."""
        return np.maximum(self._shares, min(DEEP / self.origin.done, DEEPEST))

    @cached_property
    def _quantiles(self) -> Array:
        """Outer tails and median, float64[response, 3]."""
        units = self.origin.units
        quantiles = partial(
            np.quantile, weights=units, method="linear" if units is None else WEIGHTED
        )
        columns = zip(self.responses.T, self._tails, strict=True)
        return np.array([quantiles(y, [p, 0.5, 1 - p]) for y, p in columns])

    @property
    def variance(self) -> Array:
        """Of the responses, float64[response]."""
        mean = partial(np.average, axis=0, weights=self.origin.units)
        return np.asarray(mean((self.responses - mean(self.responses)) ** 2))

    @property
    def middle(self) -> Array:
        """The medians, float64[response]."""
        return np.asarray(self._quantiles[:, 1])

    @property
    def room(self) -> Array:
        """Distances of both ends from the median, float64[response, end]."""
        return np.asarray((self.origin.permitted - self.middle[:, None]) * [-1, 1])

    @cached_property
    def _shares(self) -> Array:
        """The permitted share of the trials that are done, by response, at an end."""
        done, failed = self.origin.done, self.origin.failed
        ends = np.isfinite(self.origin.permitted).sum(axis=1)
        out = self.origin.permitted_out * (done + failed) - failed
        return np.asarray(np.maximum(out, RAREST) / done / ends)

    @property
    def reach(self) -> Array:
        """How far from the median the permitted share begins, float64[response, end].

        As far as trials show it. Farther as in a normal tail.
        """
        lower, middle, upper = self._quantiles.T
        reach = np.stack([middle - lower, upper - middle], axis=1)
        return np.asarray(reach * (ndtri(self._shares) / ndtri(self._tails))[:, None])

    @cached_property
    def margins(self) -> Array:
        """Room over reach, float64[response, end]; infinite at open ends.

        1 is as needed. A tail without spread is judged by its count out of limit, as
        the quantile of a normal response over the needed one.
        """
        room, reach = self.room, self.reach
        with np.errstate(divide="ignore", invalid="ignore"):
            margins = np.where(np.isinf(room), np.inf, room / reach)
        lower, upper = rounded_out(*self.origin.permitted.T)
        done, failed = self.origin.done, self.origin.failed
        for j, end in np.argwhere(reach <= POINT_MASS * np.abs(room)):
            y = self.responses[:, j]
            out = self.origin.out_of(y > upper[j] if end else y < lower[j]) - failed
            share = (out + 0.5) / (done + 1)
            if np.isfinite(room[j, end]):
                margins[j, end] = ndtri(share) / ndtri(self._shares[j])
        return margins

    @property
    def score(self) -> float:
        """The least margin."""
        return float(self.margins.min())

    def deficit(self, aim: float) -> float:
        """Return what the margins of all responses lack: several may lack equally."""
        return float(np.maximum(aim - self.margins.min(axis=1), 0).sum())

    @property
    def slopes(self) -> Array:
        """First derivatives at the present centre, float64[entry, response]."""
        entries = self.origin.design.entries
        gradient = self.origin.surface.slopes_at(self.change.shift[entries])
        summed = np.zeros((len(self.change.shift), gradient.shape[1]))
        np.add.at(summed, entries, gradient)
        return summed


def movable_trials(
    deviations: Array,
    responses: Array,
    sample: Sample,
    limits: list[Limit],
    design: Design,
) -> MovableTrials | NoRemedy:
    """Return the trials of a run as movable ones, or why no remedy can be searched.

    Parameters
    ----------
    deviations, responses : float64[trial, contributor], float64[trial, response]
        SI; of trials of the sample. Responses with a limit only.
    limits : list of Limit, one a response
    """
    done, thinned, units = sample.done, None, sample.ran.astype(np.float64)
    if sample.thinned:
        thinned, units = sample, sample.thinned.units
    failed, ran = float(units[sample.failed_trials].sum()), units.sum()
    permitted = np.array([limit.permitted for limit in limits]).reshape(-1, 2)
    out = np.array([1 - limit.demanded for limit in limits])
    refusals = {
        NoRemedy.LIMITS: not limits,
        NoRemedy.FREE: not design.free.any(),
        NoRemedy.WEIGHTED: sample.weights is not None,
        NoRemedy.TRIALS: done.sum() < LEAST_TRIALS,
        NoRemedy.FAILED: bool(np.any(failed >= out * ran)),
    }
    for reason, refused in refusals.items():
        if refused:
            return reason
    z, responses = design.scaled(deviations[done]), responses[done]
    return MovableTrials(
        z, responses, failed, permitted, out, design, _surface(z, responses),
        units[done] if thinned else None, thinned,
    )  # fmt: skip


def _surface(z: Array, responses: Array) -> Surface:
    """Return the surface of a part of the trials, if these are many."""
    chosen = slice(None, None, -(-len(z) // MOST_FITTED))
    return fitted_surface(z[chosen], responses[chosen])
