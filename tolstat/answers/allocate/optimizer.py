"""The cheapest choice within bounds: continuous, from lists, or both."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

Array = NDArray[np.float64]
Choice = tuple[float, ...]

MOST_TRIED, MOST_SOLVED = 4096, 64  # combinations of lists, without and with others
STEP = 1e-4  # of continuous variables, for slopes
MOST_STEPS = 60
HALVINGS = 12  # from inside the bounds towards just outside
MET = 1e-4  # of a bound: a logarithm, or a share of the room
LITTLE = 1e-4  # of the cost: less is not worth a move


class DesignVariable(NamedTuple):
    """A design variable, and the cost of a choice.

    From tightest to loosest, where the cost is least; with a list, the whole numbers
    from 0, the loosest, to `listed` less 1.
    """

    cost: Callable[[float], float]
    tightest: float
    loosest: float
    listed: int = 0


class Cheapest(NamedTuple):
    """A choice within the bounds, one number for each variable, and its cost.

    `every` tells whether every combination of lists was tried; else they were exchanged
    one or two at a time until none was cheaper.
    """

    choice: Choice
    cost: float
    every: bool


def cheapest(
    variables: Sequence[DesignVariable],
    excess: Callable[[Choice], Array],
    start: Choice | None = None,
) -> Cheapest | None:
    """Find the cheapest choice within all bounds.

    Parameters
    ----------
    variables : sequence of DesignVariable
        To be chosen.
    excess : callable
        float64[bound] of a choice: its distance outside each bound, 0 or less within;
        smooth in continuous variables, and not always least at the tightest.
    start : tuple of float, optional
        First choice; halfway between the ends if not given.

    Returns
    -------
    Cheapest or None
        Continuous variables by sequential quadratic programming, lists in order of
        their cost. None where no choice that was tried is within the bounds: of the
        continuous ones both ends, the start, the middle, and the solution.
    """
    search = _Search(variables, excess, start)
    count = math.prod(variable.listed or 1 for variable in variables)
    every = count <= (MOST_SOLVED if search.continuous else MOST_TRIED)
    found = search.every() if every else search.exchanged()
    return Cheapest(found, search.cost(found), every) if found else None


class _Search:
    def __init__(
        self,
        variables: Sequence[DesignVariable],
        excess: Callable[[Choice], Array],
        start: Choice | None,
    ) -> None:
        self.variables, self.excess = variables, excess
        self.continuous = [
            i for i, variable in enumerate(variables) if not variable.listed
        ]
        self.listed = [i for i, variable in enumerate(variables) if variable.listed]
        self.start = start or tuple(
            float((d.listed - 1) // 2) if d.listed else 0.5 * (d.tightest + d.loosest)
            for d in variables
        )

    def cost(self, choice: Choice) -> float:
        return sum(
            variable.cost(x) for variable, x in zip(self.variables, choice, strict=True)
        )

    def keeps(self, choice: Choice) -> bool:
        return bool(np.all(self.excess(choice) <= MET))

    def every(self) -> Choice | None:
        """Try the combinations of lists, the cheapest first."""
        least = [variable.loosest for variable in self.variables]
        tried = []
        for chosen in product(*(range(self.variables[i].listed) for i in self.listed)):
            whole = list(least)
            for i, x in zip(self.listed, chosen, strict=True):
                whole[i] = float(x)
            tried.append((self.cost(tuple(whole)), tuple(whole)))
        best, known = None, math.inf
        for bound, choice in sorted(tried):
            if bound >= known:
                break
            found = self.settled(choice)
            if found and (cost := self.cost(found)) < known:
                best, known = found, cost
        return best

    def exchanged(self) -> Choice | None:
        """Move one or two lists by one while that is cheaper."""
        # the tightest is not always safe: estimates may be sharper between
        tight = tuple(variable.tightest for variable in self.variables)
        current = self.settled(tight) or self.settled(self.start)
        while current and (cheaper := self._cheaper(current)):
            current = cheaper
        return current

    def _cheaper(self, current: Choice) -> Choice | None:
        """Return a cheaper neighbour within the bounds.

        The cheapest one; the first found where continuous ones follow each move.
        """
        known = self.cost(current) * (1 - LITTLE)
        near = []
        for each in self._neighbours(current):
            pairs = zip(self.variables, each, strict=True)
            least = [
                x if variable.listed else variable.loosest for variable, x in pairs
            ]
            near.append((self.cost(tuple(least)), each))
        for bound, choice in sorted(near):
            if bound >= known:
                return None
            found = self.settled(choice)
            if found and self.cost(found) < known:
                return found
        return None

    def _neighbours(self, current: Choice) -> Iterator[Choice]:
        """Yield choices with one list moved; with two where none is continuous."""
        moves = [
            (i, x)
            for i in self.listed
            for x in (current[i] - 1, current[i] + 1)
            if 0 <= x < self.variables[i].listed
        ]
        for i, x in moves:
            one = (*current[:i], x, *current[i + 1 :])
            yield one
            for j, y in moves if not self.continuous else ():
                if j > i:
                    yield (*one[:j], y, *one[j + 1 :])

    def settled(self, choice: Choice) -> Choice | None:
        """Choose the continuous ones for given lists; None if no choice is within."""
        if not self.continuous:
            return choice if self.keeps(choice) else None
        tightest = np.array([self.variables[i].tightest for i in self.continuous])
        loosest = np.array([self.variables[i].loosest for i in self.continuous])
        span = loosest - tightest

        def at(share: Array) -> Choice:
            whole = list(choice)
            # a step for a slope may pass an end
            for i, x in zip(self.continuous, tightest + span * share, strict=True):
                whole[i] = float(x)
            return tuple(whole)

        ends = [np.ones(len(span)), np.full(len(span), 0.5), np.zeros(len(span))]
        loose, middle, _ = ends
        if self.keeps(at(loose)):
            return at(loose)
        scale = self.cost(at(middle))
        own = np.array([self.start[i] for i in self.continuous])
        begin = np.clip((own - tightest) / span, 0.0, 1.0)
        with np.errstate(invalid="ignore"):  # an excess may be infinite
            solved = minimize(
                lambda share: self.cost(at(share)) / scale,
                begin,
                method="SLSQP",
                bounds=[(0.0, 1.0)] * len(span),
                constraints={
                    "type": "ineq",
                    "fun": lambda share: -self.excess(at(share)),
                },
                options={"maxiter": MOST_STEPS, "eps": STEP, "ftol": 1e-5},
            )
        found = np.where(np.isfinite(solved.x), np.clip(solved.x, 0.0, 1.0), begin)
        kept = [each for each in (begin, *ends[1:]) if self.keeps(at(each))]
        if self.keeps(at(found)):
            near = [at(each) for each in (found, *kept)]
        else:
            near = [self._near(found, each, at) for each in kept]
        return min(near, key=self.cost, default=None)

    def _near(
        self, outside: Array, within: Array, at: Callable[[Array], Choice]
    ) -> Choice:
        """Move a choice just outside the bounds towards one within, until it is."""
        known, there = 0.0, 1.0  # of the way from within to outside
        for _ in range(HALVINGS):
            middle = 0.5 * (known + there)
            if self.keeps(at(within + middle * (outside - within))):
                known = middle
            else:
                there = middle
        return at(within + known * (outside - within))
