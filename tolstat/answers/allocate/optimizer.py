"""The cheapest choice within some bounds: of continuous variables, lists, or both."""

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations, product
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize

from tolstat.arrays import Array

Choice = tuple[float, ...]
Excess = Callable[[Choice], Array]

MOST_TRIED, MOST_SOLVED = 4096, 64  # combinations of lists, without and with the others
CENTRING = 3e-3  # of the cost, for each e-th of what is out of limit: shifts are free
STEP = 1e-4  # of a continuous variable, for slopes
MOST_STEPS = 60
HALVINGS = 12  # between a choice within the bounds and one that is not
MET = 1e-4  # of a bound: a logarithm, or a share of the room
LITTLE = 1e-4  # of the cost: a move that saves less is not made


class DesignVariable(NamedTuple):
    """A design variable, and the cost of a choice.

    From tightest to loosest, where the cost is least; of a list, the whole numbers from
    0, the loosest, to one less than its `options`. A shift is cheapest at 0, also
    between.
    """

    cost: Callable[[float], float]
    tightest: float
    loosest: float
    options: int = 0
    shift: bool = False


class Cheapest(NamedTuple):
    """A choice within the bounds, one number for each variable, and its cost.

    `exhaustive` tells whether every combination of lists was tried; else options were
    exchanged, one or two at a time, until none was cheaper.
    """

    choice: Choice
    cost: float
    exhaustive: bool


def cheapest(
    variables: Sequence[DesignVariable], excess: Excess, start: Choice | None = None
) -> Cheapest | None:
    """Return the cheapest choice within all bounds.

    Continuous variables by sequential quadratic programming from a start, or halfway;
    lists by trying their combinations in order of cost.

    Parameters
    ----------
    variables : sequence of DesignVariable
        The variables to choose.
    excess : callable
        float64[bound] of a choice: how far it exceeds each bound, 0 or less within;
        smooth in the continuous variables, and not always least at the tightest.
    start : tuple of float, optional
        A choice to begin with.

    Returns
    -------
    Cheapest or None
        None where nothing tried is within the bounds.
    """
    halfway = tuple(
        float((v.options - 1) // 2) if v.options else 0.5 * (v.tightest + v.loosest)
        for v in variables
    )
    search = _Search(variables, excess, start or halfway)
    count = math.prod(variable.options or 1 for variable in variables)
    exhaustive = count <= (MOST_SOLVED if search.continuous else MOST_TRIED)
    best = search.of_all() if exhaustive else search.exchanged()
    return Cheapest(best, search.cost(best), exhaustive) if best else None


@dataclass(frozen=True)
class _Search:
    variables: Sequence[DesignVariable]
    excess: Excess
    start: Choice

    @property
    def continuous(self) -> list[int]:
        return [i for i, v in enumerate(self.variables) if not v.options]

    def cost(self, choice: Choice) -> float:
        return sum(v.cost(x) for v, x in zip(self.variables, choice, strict=True))

    def within(self, choice: Choice) -> bool:
        return bool(np.all(self.excess(choice) <= MET))

    def least_cost(self, choice: Choice) -> float:
        """Return the cost with all continuous variables at their loosest."""
        pairs = zip(self.variables, choice, strict=True)
        return self.cost(tuple(x if v.options else v.loosest for v, x in pairs))

    def of_all(self) -> Choice | None:
        """Try the combinations of lists."""
        ranges = (
            range(v.options) if v.options else (v.loosest,) for v in self.variables
        )
        return self._cheaper(product(*ranges), math.inf)

    def exchanged(self) -> Choice | None:
        """Move one list or two by an option, while that is cheaper."""
        # tight is not always safe: a bound may be known better between
        tight = tuple(variable.tightest for variable in self.variables)
        current = following = self.solved(tight) or self.solved(self.start)
        while current and following:
            current, cost = following, self.cost(following) * (1 - LITTLE)
            # continuous variables follow each move: the first that is cheaper
            following = self._cheaper(self._neighbours(current), cost, first=True)
        return current

    def _cheaper(
        self, choices: Iterable[Choice], cost: float, *, first: bool = False
    ) -> Choice | None:
        """Return the cheapest within the bounds, or the first, below a cost.

        Those that may be cheapest are tried first.
        """
        best = None
        for bound, choice in sorted((self.least_cost(c), c) for c in choices):
            if bound >= cost or (best and first):
                break
            solved = self.solved(tuple(map(float, choice)))
            if solved and self.cost(solved) < cost:
                best, cost = solved, self.cost(solved)
        return best

    def _neighbours(self, current: Choice) -> Iterator[Choice]:
        """Yield choices with one list moved; with two if no variable is continuous."""
        moves = [
            {i: x}
            for i, variable in enumerate(self.variables)
            for x in (current[i] - 1, current[i] + 1)
            if variable.options and 0 <= x < variable.options
        ]
        if not self.continuous:
            pairs = combinations(moves, 2)
            moves += [a | b for a, b in pairs if a.keys() != b.keys()]
        for move in moves:
            yield tuple(move.get(i, x) for i, x in enumerate(current))

    def solved(self, choice: Choice) -> Choice | None:
        """Choose the continuous variables; None if nothing tried is within bounds."""
        if not self.continuous:
            return choice if self.within(choice) else None
        variables = [self.variables[i] for i in self.continuous]
        tightest = np.array([variable.tightest for variable in variables])
        span = np.array([variable.loosest for variable in variables]) - tightest

        def choice_at(share: Array) -> Choice:
            # a step for a slope may lead past an end
            values = dict(zip(self.continuous, tightest + span * share, strict=True))
            return tuple(float(values.get(i, x)) for i, x in enumerate(choice))

        start = np.array([self.start[i] for i in self.continuous])
        begin = np.clip((start - tightest) / span, 0.0, 1.0)
        shift = np.array([variable.shift for variable in variables])
        middle, tight = (np.where(shift, begin, share) for share in (0.5, 0.0))
        loose = np.where(shift, -tightest / span, 1.0)  # not shifted
        if self.within(choice_at(loose)):
            return choice_at(loose)
        scale = self.cost(choice_at(middle)) or 1.0

        def objective(share: Array) -> float:
            out = float(np.mean(self.excess(choice_at(share)))) if shift.any() else 0.0
            return self.cost(choice_at(share)) / scale + CENTRING * out

        def room(share: Array) -> Array:
            return -self.excess(choice_at(share))

        with np.errstate(invalid="ignore"):  # an excess may be infinite
            solved = minimize(
                objective, begin, method="SLSQP", bounds=[(0.0, 1.0)] * len(span),
                constraints={"type": "ineq", "fun": room},
                options={"maxiter": MOST_STEPS, "eps": STEP, "ftol": 1e-5},
            ).x  # fmt: skip
        solved = np.where(np.isfinite(solved), np.clip(solved, 0.0, 1.0), begin)
        starts = begin, middle, tight
        safe = [share for share in starts if self.within(choice_at(share))]
        if self.within(choice_at(solved)):
            choices = [choice_at(share) for share in (solved, *safe)]
            if shift.any():  # far within bounds slopes say little
                outside = np.where(shift, loose, solved)
                choices.append(self._towards(outside, solved, choice_at))
        else:
            choices = [self._towards(solved, share, choice_at) for share in safe]
        return min(choices, key=self.cost, default=None)

    def _towards(
        self, outside: Array, inside: Array, choice_at: Callable[[Array], Choice]
    ) -> Choice:
        """Go from inside the bounds towards outside as far as they permit."""
        inner, outer = 0.0, 1.0  # of the way: within the bounds, and not
        for _ in range(HALVINGS):
            middle = 0.5 * (inner + outer)
            if self.within(choice_at(inside + middle * (outside - inside))):
                inner = middle
            else:
                outer = middle
        return choice_at(inside + inner * (outside - inside))
