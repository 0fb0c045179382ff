"""Stored trials that move with a change of contributors."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import Enum
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.special import ndtri

from tolstat.arrays import Array, Integers, Truths
from tolstat.statistics.limits.limit import Limit
from tolstat.statistics.remedies.surface import Surface, fitted_surface
from tolstat.statistics.sample import Sample

LEAST_TRIALS = 200
DEEP, DEEPEST = 10.0, 0.02  # trials in the tail that shows the spread; its most
POINT_MASS = 1e-9  # of the room to a limit: a tail without any spread
RAREST = 1e-9  # permitted trials, where as many fail as are permitted
FIGURES = 3  # significant ones of a tolerance on a drawing


class NoRemedy(Enum):
    """Why no remedy is searched; the value is the sentence."""

    LIMITS = "no response has a limit"
    FREE = "all contributors are fixed"
    GRID = "trials of a grid or a table are no sample"
    WEIGHTED = "trials of a rare run are weighted"
    TRIALS = f"needs {LEAST_TRIALS} trials that are done"
    FAILED = "more trials fail than a limit permits out of limit"


class Change(NamedTuple):
    """A change of entries: centres move by a shift, spreads are multiplied.

    Attributes
    ----------
    shift : float64[entry]
        In half tolerances of the entry.
    ratio : float64[entry]
        Of the spread about the centre: new over old, at most 1.
    """

    shift: Array
    ratio: Array

    @property
    def shifted(self) -> Integers:
        """The entries whose centre moves."""
        return np.flatnonzero(self.shift)

    @property
    def tightened(self) -> Integers:
        """The entries whose spread shrinks."""
        return np.flatnonzero(self.ratio < 1)

    @property
    def size(self) -> float:
        """Sum of all shifts, in half tolerances."""
        return float(np.abs(self.shift).sum())

    def at(self, entry: int, **values: float) -> Change:
        """Return the change with another shift or ratio of an entry."""
        change = Change(self.shift.copy(), self.ratio.copy())
        for field, value in values.items():
            getattr(change, field)[entry] = value
        return change

    def then(self, other: Change) -> Change:
        """Return both; the other one counts in half tolerances after this one."""
        return Change(self.shift + self.ratio * other.shift, self.ratio * other.ratio)


class Design(NamedTuple):
    """What a remedy may change.

    Attributes
    ----------
    centres : float64[contributor]
        Of the deviations, SI.
    entries : int64[contributor]
        Which entry of the study it belongs to, from 0: all of an entry change together.
    halves : float64[entry]
        Half the tolerance, SI, above 0: the widest of its contributors.
    steps : float64[entry]
        To which a drawing rounds shifts and half tolerances, SI: see `drawing_step`.
    free : bool[entry]
        False if no remedy may change it.
    """

    centres: Array
    entries: Integers
    halves: Array
    steps: Array
    free: Truths

    @property
    def none(self) -> Change:
        """The change that changes nothing."""
        return Change(np.zeros(len(self.halves)), np.ones(len(self.halves)))

    def scaled(self, deviations: Array) -> Array:
        """Return deviations from their centres, over half the tolerance."""
        return np.asarray((deviations - self.centres) / self.halves[self.entries])

    def members(self, change: Change) -> tuple[Array, Array]:
        """Return shift and ratio by contributor."""
        return change.shift[self.entries], change.ratio[self.entries]

    def changed(self, change: Change) -> Design:
        """Return the design after a change."""
        shifts = (change.shift * self.halves)[self.entries]
        halves = change.ratio * self.halves
        return self._replace(centres=self.centres + shifts, halves=halves)

    def rounded(self, change: Change) -> Change:
        """Round shifts to the nearest step, half tolerances to the next below."""
        grid = self.steps / self.halves
        shift = np.round(change.shift / grid) * grid
        coarse = np.maximum(np.floor(change.ratio / grid + 1e-6), 1) * grid
        ratio = np.where(change.ratio < 1, np.minimum(coarse, 1.0), 1.0)
        return Change(shift, ratio)


def drawing_step(half: float, factor: float = 1.0) -> float:
    """Return the step that a drawing has: three figures of half a tolerance, SI.

    `factor` leads to the unit of the drawing.

    Examples
    --------
    >>> drawing_step(0.12e-3, factor=1e3)  # +-0.12 mm, by 0.001 mm
    1e-06
    """
    decimals = math.floor(math.log10(half * factor)) + 1 - FIGURES
    return float(f"1e{decimals}") / factor


@dataclass(frozen=True)
class MovableTrials:
    """Trials that are done, and the limits of their responses.

    Attributes
    ----------
    z : float64[trial, contributor]
        Deviations from their centres, over half the tolerance.
    responses : float64[trial, response]
        SI.
    failed : int
        Trials that failed: out of all limits, whatever changes.
    permitted : float64[response, end]
        Infinite where an end is open.
    permitted_out : float64[response]
        The permitted share out of limit.
    """

    z: Array
    responses: Array
    failed: int
    permitted: Array
    permitted_out: Array
    design: Design
    surface: Surface

    def thinned(self, most: int) -> MovableTrials:
        """Return so many of the trials at most, with the surface of all."""
        chosen = slice(None, None, -(-len(self.z) // most))
        z, responses = self.z[chosen], self.responses[chosen]
        failed = round(self.failed * len(z) / len(self.z))
        return replace(self, z=z, responses=responses, failed=failed)

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
            surface=fitted_surface(z, y),
        )  # fmt: skip

    def with_design(self, design: Design) -> MovableTrials:
        """Return the same trials; other contributors may change."""
        return replace(self, design=design)

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
        return np.maximum(self._shares, min(DEEP / len(self.responses), DEEPEST))

    @cached_property
    def _quantiles(self) -> Array:
        """Outer tails and median, float64[response, 3]."""
        columns = zip(self.responses.T, self._tails, strict=True)
        return np.array([np.quantile(y, [p, 0.5, 1 - p]) for y, p in columns])

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
        done, failed = len(self.responses), self.origin.failed
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
        lower, upper = self.origin.permitted.T
        done = len(self.responses)
        for j, end in np.argwhere(reach <= POINT_MASS * np.abs(room)):
            y = self.responses[:, j]
            out = np.count_nonzero(y > upper[j] if end else y < lower[j])
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
        surface, entries = self.origin.surface, self.origin.design.entries
        gradient = surface.slopes + (surface.bends @ self.change.shift[entries]).T
        summed = np.zeros((len(self.change.shift), gradient.shape[1]))
        np.add.at(summed, entries, gradient)
        return summed


def movable_trials(
    deviations: Array,
    responses: Array,
    sample: Sample,
    limits: list[Limit],
    design: Design,
    grid: bool = False,
) -> MovableTrials | NoRemedy:
    """Return the trials of a run as movable ones, or why no remedy can be searched.

    Parameters
    ----------
    deviations, responses : float64[trial, contributor], float64[trial, response]
        SI; of trials of the sample. Responses with a limit only.
    limits : list of Limit, one a response
    grid : bool
        Whether trials are of a grid or a table.
    """
    done = sample.done
    permitted = np.array([limit.permitted for limit in limits]).reshape(-1, 2)
    out = np.array([1 - limit.demanded for limit in limits])
    refusals = {
        NoRemedy.LIMITS: not limits,
        NoRemedy.FREE: not design.free.any(),
        NoRemedy.GRID: grid,
        NoRemedy.WEIGHTED: sample.weights is not None,
        NoRemedy.TRIALS: done.sum() < LEAST_TRIALS,
        NoRemedy.FAILED: bool(np.any(sample.failed >= out * sample.ran.sum())),
    }
    for reason, refused in refusals.items():
        if refused:
            return reason
    z, responses = design.scaled(deviations[done]), responses[done]
    surface = fitted_surface(z, responses)
    return MovableTrials(z, responses, sample.failed, permitted, out, design, surface)
