"""The cheapest choice that keeps to some bounds: steadily, out of lists, or both."""

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

MOST_TRIED, MOST_SOLVED = 4096, 64  # combinations of lists, without and with the others
STEP = 1e-4  # of what is chosen steadily, for slopes
MOST_STEPS = 60
HALVINGS = 12  # from what keeps to the bounds towards what does not quite
MET = 1e-4  # of a bound: a logarithm, or a share of the room
LITTLE = 1e-4  # of the cost: what is not worth a move


class Dial(NamedTuple):
    """What can be chosen of one thing.

    Attributes
    ----------
    cost : callable
        Of a choice.
    tightest, loosest : float
        Ends of what can be chosen; the cost is least at the loosest.
    listed : int
        0: everything between; else only the whole numbers from 0 to this less 1, of
        which 0 is the loosest.
    """

    cost: Callable[[float], float]
    tightest: float
    loosest: float
    listed: int = 0


class Cheapest(NamedTuple):
    """A choice that keeps to the bounds.

    Attributes
    ----------
    choice : tuple of float
        One of each dial.
    cost : float
        Of all.
    every : bool
        Whether every combination of lists was looked at; else they were exchanged one
        or two at a time until none was cheaper.
    """

    choice: Choice
    cost: float
    every: bool


def cheapest(
    dials: Sequence[Dial],
    excess: Callable[[Choice], Array],
    start: Choice | None = None,
) -> Cheapest | None:
    """Find the cheapest choice that keeps to all bounds.

    Parameters
    ----------
    dials : sequence of Dial
        What can be chosen.
    excess : callable
        float64[bound] of a choice: how far it is beyond each bound, 0 or less where it
        keeps to it; smooth in what is chosen steadily, and not always least at the
        tightest.
    start : tuple of float, optional
        A choice to begin with; halfway between the ends if not given.

    Returns
    -------
    Cheapest or None
        Steady dials by sequential quadratic programming, lists by trying them in order
        of their cost; None where nothing that was tried keeps to the bounds: of the
        steady ones both ends, the start, the middle, and what was solved for.
    """
    search = _Search(dials, excess, start)
    count = math.prod(dial.listed or 1 for dial in dials)
    every = count <= (MOST_SOLVED if search.steady else MOST_TRIED)
    found = search.every() if every else search.exchanged()
    return Cheapest(found, search.cost(found), every) if found else None


class _Search:
    def __init__(
        self,
        dials: Sequence[Dial],
        excess: Callable[[Choice], Array],
        start: Choice | None,
    ) -> None:
        self.dials, self.excess = dials, excess
        self.steady = [i for i, dial in enumerate(dials) if not dial.listed]
        self.listed = [i for i, dial in enumerate(dials) if dial.listed]
        self.start = start or tuple(
            float((d.listed - 1) // 2) if d.listed else 0.5 * (d.tightest + d.loosest)
            for d in dials
        )

    def cost(self, choice: Choice) -> float:
        return sum(dial.cost(x) for dial, x in zip(self.dials, choice, strict=True))

    def keeps(self, choice: Choice) -> bool:
        return bool(np.all(self.excess(choice) <= MET))

    def every(self) -> Choice | None:
        """Try the combinations of lists, the cheapest first."""
        least = [dial.loosest for dial in self.dials]
        tried = []
        for chosen in product(*(range(self.dials[i].listed) for i in self.listed)):
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
        """Move lists by one, or two of them, while that is cheaper."""
        # tight is not always safe: what is bounded may be known better between
        tight = tuple(dial.tightest for dial in self.dials)
        current = self.settled(tight) or self.settled(self.start)
        while current and (cheaper := self._cheaper(current)):
            current = cheaper
        return current

    def _cheaper(self, current: Choice) -> Choice | None:
        """Return a neighbour that keeps to the bounds and is cheaper.

        The cheapest one; with steady ones, which follow each move, the first found.
        """
        known = self.cost(current) * (1 - LITTLE)
        near = []
        for each in self._neighbours(current):
            least = [dial.loosest if not dial.listed else x
                     for dial, x in zip(self.dials, each, strict=True)]  # fmt: skip
            near.append((self.cost(tuple(least)), each))
        for bound, choice in sorted(near):
            if bound >= known:
                return None
            found = self.settled(choice)
            if found and self.cost(found) < known:
                return found
        return None

    def _neighbours(self, current: Choice) -> Iterator[Choice]:
        """Yield choices with one list moved; with two where none is steady."""
        moves = [
            (i, x)
            for i in self.listed
            for x in (current[i] - 1, current[i] + 1)
            if 0 <= x < self.dials[i].listed
        ]
        for i, x in moves:
            one = (*current[:i], x, *current[i + 1 :])
            yield one
            for j, y in moves if not self.steady else ():
                if j > i:
                    yield (*one[:j], y, *one[j + 1 :])

    def settled(self, choice: Choice) -> Choice | None:
        """Choose the steady ones, with the lists as they are; None if nothing keeps."""
        if not self.steady:
            return choice if self.keeps(choice) else None
        tightest = np.array([self.dials[i].tightest for i in self.steady])
        loosest = np.array([self.dials[i].loosest for i in self.steady])
        span = loosest - tightest

        def at(share: Array) -> Choice:
            whole = list(choice)
            # a step for a slope may lead past an end
            for i, x in zip(self.steady, tightest + span * share, strict=True):
                whole[i] = float(x)
            return tuple(whole)

        ends = [np.ones(len(span)), np.full(len(span), 0.5), np.zeros(len(span))]
        loose, middle, _ = ends
        if self.keeps(at(loose)):
            return at(loose)
        scale = self.cost(at(middle))
        own = np.array([self.start[i] for i in self.steady])
        begin = np.clip((own - tightest) / span, 0.0, 1.0)
        with np.errstate(invalid="ignore"):  # how far beyond may be infinite
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
        self, beyond: Array, within: Array, at: Callable[[Array], Choice]
    ) -> Choice:
        """Move what is not quite within the bounds towards what is, until it is."""
        known, there = 0.0, 1.0  # of the way from within to beyond
        for _ in range(HALVINGS):
            middle = 0.5 * (known + there)
            if self.keeps(at(within + middle * (beyond - within))):
                known = middle
            else:
                there = middle
        return at(within + known * (beyond - within))
