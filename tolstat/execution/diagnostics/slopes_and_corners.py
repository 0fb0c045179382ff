"""What tolerance analysis asked for before Monte Carlo: slopes, and the worst case."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.execution.workers.crew import Workers
from tolstat.model.contract import Model

Array = NDArray[np.float64]

Move = tuple[list[int], Array]  # columns, and the ends they are moved to
STEP = 0.1  # of a usual deviation, to either side of the machine
MOST_SWEEPS = 8


def slopes(
    model: Model,
    settings: Any,
    usual: Array,
    workers: Workers,
    at: Array | None = None,
) -> Array:
    """Differentiate the responses at one machine.

    Parameters
    ----------
    model : Model
        The machine.
    settings : object
        Of it.
    usual : float64[contributor]
        How far each contributor usually departs, SI; one of zero has no slope.
    workers : Workers
        Who evaluate.
    at : float64[contributor], optional
        Deviations of the machine, SI; the nominal one if not given.

    Returns
    -------
    float64[contributor, response]
        By central differences over a tenth of that to either side;
        NaN where a machine failed.
    """
    varying = np.flatnonzero(usual > 0)
    if not len(varying):
        return np.zeros((len(usual), len(model.describe(settings).responses)))
    rows = np.zeros((2, len(varying), len(usual)))
    step = STEP * usual[varying]
    for place, column in enumerate(varying):
        rows[:, place, column] = step[place], -step[place]
    machines = rows.reshape(-1, len(usual))
    if at is not None:
        machines += at
    found = workers.simulate(model, machines, settings).responses
    ahead, behind = found.reshape(2, len(varying), found.shape[1])
    every = np.zeros((len(usual), found.shape[1]))
    every[varying] = (ahead - behind) / (2 * step[:, None])
    return every


class Target(NamedTuple):
    """What is to be as bad as can be."""

    response: int  # its column
    sign: int  # 1 for the largest value, -1 for the least
    # float64[start, contributor]: machines of which the worst is begun with
    starts: Array


class Corner(NamedTuple):
    """The worst machine found; most often, not always, a corner of the tolerances."""

    value: float  # of the response, SI; NaN if every machine tried failed
    deviations: Array  # float64[contributor]: the machine
    # machines simulated for it, and how many of these failed
    tried: int
    failed: int


def worst_corners(
    model: Model,
    settings: Any,
    lower: Array,
    upper: Array,
    factors: Sequence[Sequence[int]],
    targets: Sequence[Target],
    workers: Workers,
) -> list[Corner]:
    """Search the corners of the tolerances for the worst machines.

    Every factor, columns that change together, is moved to either end of its tolerance
    (float64[contributor], SI); what makes a target worse is taken, all at once if that
    is worse still, until nothing is. A local search: no proof, and no probability.
    """
    current = [_Search(target, lower, upper, factors) for target in targets]
    for _ in range(2 * MOST_SWEEPS + 1):
        asked = [search.asked() for search in current]
        if not any(len(rows) for rows in asked):
            break
        found = workers.simulate(model, np.concatenate(asked), settings).responses
        ends = np.cumsum([len(rows) for rows in asked])
        for search, responses in zip(current, np.split(found, ends[:-1]), strict=True):
            search.take(responses)
    return [search.corner for search in current]


class _Search:
    """The search for one target: what it asks next, and what it makes of it."""

    def __init__(
        self,
        target: Target,
        lower: Array,
        upper: Array,
        factors: Sequence[Sequence[int]],
    ) -> None:
        self.target = target
        self.moves = [
            (list(columns), end[list(columns)])
            for columns in factors
            for end in (lower, upper)
        ]
        self.tried: list[Move] = []
        self.rows = target.starts
        self.corner = Corner(np.nan, target.starts[0], 0, 0)
        self.sweeping = False
        self.over = False

    def asked(self) -> Array:
        """Return machines to be simulated; none once the search is over."""
        return self.rows[:0] if self.over else self.rows

    def take(self, responses: Array) -> None:
        """Take what these machines answered, and choose the next ones."""
        if self.over:
            return
        values = responses[:, self.target.response]
        best, value, machine = self.corner, self.corner.value, self.corner.deviations
        badness = np.where(np.isnan(values), -np.inf, self.target.sign * values)
        known = -np.inf if np.isnan(value) else self.target.sign * value
        most = int(badness.argmax())
        before = machine
        if badness[most] > known:
            value, machine = float(values[most]), self.rows[most]
        self.corner = Corner(
            value,
            machine,
            best.tried + len(values),
            best.failed + int(np.isnan(values).sum()),
        )
        if np.isnan(value):
            self.over = True
        elif self.sweeping:
            self.over = not badness[most] > known + 1e-9 * abs(known)
            worse = badness > known
            self._ask_for_all(before, badness, worse)
        else:
            self._sweep()

    def _sweep(self) -> None:
        """Ask for every single move."""
        machine = self.corner.deviations
        # what is at that end already is no move
        self.tried = [(c, end) for c, end in self.moves if np.any(machine[c] != end)]
        rows = [_moved(machine, [move]) for move in self.tried]
        self.rows = np.array(rows).reshape(-1, len(machine))
        self.sweeping, self.over = True, not rows

    def _ask_for_all(
        self, before: Array, badness: Array, worse: NDArray[np.bool_]
    ) -> None:
        """Ask for all moves at once that made it worse, of two ends the worse one."""
        taken: dict[int, Move] = {}  # by first column: one of both ends
        for i in np.lexsort((-np.arange(len(badness)), badness)):
            if worse[i]:
                taken[self.tried[i][0][0]] = self.tried[i]
        self.rows = _moved(before, list(taken.values()))[None, :]
        self.sweeping = False


def _moved(machine: Array, moves: Sequence[Move]) -> Array:
    """Return a machine with some of its parts at an end of their tolerance."""
    found = machine.copy()
    for columns, ends in moves:
        found[columns] = ends
    return found
