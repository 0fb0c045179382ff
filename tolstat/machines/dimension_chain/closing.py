"""Newton's method for the unknowns of loops, of all trials at once."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array, Truths

MOST_STEPS = 25  # of Newton's method
SETTLED = 1e-8  # of an unknown's size: what follows such a step is rounding
CLOSED = 1e-9  # of the size of a loop
WAY = 32  # steps to a trial that is not reached from the nominal machine in one
QUARTER = math.pi / 2  # of a turn: an angle moves less in one step
STARTS = 512  # of the search for all ways in which loops close
SAME = 1e-6  # of an unknown's size: the same way
# of residuals, [equation, trial], and their slopes, [trial, equation, unknown], at
# links, float64[trial], and unknowns, [unknown, trial]
Linear = Callable[[Mapping[str, Array], Array], tuple[Array, Array]]


class Solution(NamedTuple):
    """What Newton's method finds. Each trial is solved for itself."""

    unknowns: Array  # [unknown, trial]
    inverse: Array  # of the slopes of the equations, [trial, unknown, equation]
    sign: Array  # [trial] of their determinant: it differs between ways to close
    closes: Truths  # [trial]


@dataclass(frozen=True)
class Closing:
    """Equations of loops in units of their sizes, and how their unknowns are found."""

    linear: Linear
    angles: Truths  # [unknown] which are angles

    def newton(self, links: Mapping[str, Array], start: Array) -> Solution:
        """Return the solutions from a start, float64[unknown, trial]."""
        unknowns, settled = start, np.zeros(start.shape[1], dtype=bool)
        for _ in range(MOST_STEPS):
            residuals, slopes = self.linear(links, unknowns)
            step = np.einsum("tue,et->ut", _inverse(slopes)[0], residuals)
            with np.errstate(all="ignore"):
                unknowns = np.where(settled, unknowns, unknowns - step)
            settled |= np.all(np.abs(step) <= SETTLED, axis=0)
            if settled.all():
                break
        residuals, slopes = self.linear(links, unknowns)
        inverse, sign = _inverse(slopes)
        closes = settled & np.all(np.abs(residuals) <= CLOSED, axis=0)
        return Solution(unknowns, inverse, sign, closes)

    def from_nominal(
        self, nominal: Mapping[str, float], links: Mapping[str, Array], start: Solution
    ) -> Solution:
        """Return the solutions that the nominal one, `start`, becomes.

        Trials that are not reached at once are approached on the straight way from the
        nominal machine. One that does not close on this way, or in another way than the
        nominal machine, does not close.
        """
        first = np.repeat(start.unknowns, len(next(iter(links.values()))), axis=1)
        solution = self.newton(links, first)
        reached = self._reached(solution, first, start.sign)
        if reached.all():
            return solution._replace(closes=reached)
        far = ~reached
        unknowns, follows = first[:, far], np.ones(np.count_nonzero(far), dtype=bool)
        for part in np.linspace(0.0, 1.0, WAY + 1)[1:]:
            on_way = {
                n: nominal[n] + part * (x[far] - nominal[n]) for n, x in links.items()
            }
            step = self.newton(on_way, unknowns)
            follows &= self._reached(step, unknowns, start.sign)
            unknowns = np.where(follows, step.unknowns, unknowns)
        solution.unknowns[:, far] = step.unknowns
        solution.inverse[far] = step.inverse
        reached[far] = follows
        return solution._replace(closes=reached)

    def _reached(self, solution: Solution, start: Array, sign: Array) -> Truths:
        with np.errstate(invalid="ignore"):
            moved = np.abs(solution.unknowns - start)[self.angles]
        near: Truths = np.all(moved < QUARTER, axis=0)
        near &= solution.closes & (solution.sign == sign)
        return near

    def ways(self, nominal: Mapping[str, float], starts: Mapping[int, float]) -> Array:
        """Return the ways in which the nominal loops close: float64[way, unknown].

        `starts` are those of some unknowns. Angles lie within half a turn of theirs, or
        of zero.
        """
        guesses, links = self._guesses(nominal)
        middle = np.zeros(len(guesses))
        for unknown, value in starts.items():
            middle[unknown] = value
            guesses[unknown, : STARTS // 2] = value
        solution = self.newton(links, guesses)
        closing = solution.unknowns[:, solution.closes].T
        turns = np.round((closing - middle) / math.tau)
        closing = closing - np.where(self.angles, math.tau * turns, 0.0)
        if len(starts):  # the nearest ones
            chosen = [*starts]
            away = np.linalg.norm(closing[:, chosen] - middle[chosen], axis=1)
            closing = closing[away <= away.min(initial=math.inf) + SAME]
        ways = list[Array]()
        for way in closing:
            if all(np.max(np.abs(way - other)) > SAME for other in ways):
                ways.append(way)
        return np.array(ways).reshape(len(ways), len(middle))

    def nearest_miss(self, nominal: Mapping[str, float]) -> Array:
        """Return the least residuals of a search, float64[equation]."""
        from scipy.optimize import least_squares  # only for a refusal

        guesses, links = self._guesses(nominal)
        residuals = self.linear(links, guesses)[0]
        best = guesses[:, np.argmin(np.linalg.norm(residuals, axis=0))]
        one = {name: values[:1] for name, values in links.items()}
        least = least_squares(lambda x: self.linear(one, x[:, None])[0][:, 0], best)
        return np.asarray(least.fun)

    def _guesses(self, nominal: Mapping[str, float]) -> tuple[Array, dict[str, Array]]:
        """Return where a search starts, [unknown, start], and the links there."""
        rng = np.random.default_rng(0)  # the same ways every time
        turn = np.where(self.angles, math.pi, 1.0)[:, None]
        guesses = turn * rng.uniform(-1, 1, (len(turn), STARTS))
        return guesses, {name: np.full(STARTS, x) for name, x in nominal.items()}


def _inverse(slopes: Array) -> tuple[Array, Array]:
    """Return the inverse of slopes[trial, equation, unknown], and their signs.

    Where there is none it is NaN.
    """
    regular: Truths = np.all(np.isfinite(slopes), axis=(1, 2))
    size = slopes.shape[1]
    safe = np.where(regular[:, None, None], slopes, np.eye(size))
    sign = np.linalg.det(safe)
    regular &= sign != 0
    safe = np.where(regular[:, None, None], safe, np.eye(size))
    inverse = np.where(regular[:, None, None], np.linalg.inv(safe), np.nan)
    return inverse, np.where(regular, np.sign(sign), 0.0)
