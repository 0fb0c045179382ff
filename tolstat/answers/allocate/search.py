"""The search for the cheapest tolerances: weighted trials find, fresh runs prove.

For the fractions that limits permit, for others, and for the cost of the drawing.
"""

import math
from bisect import bisect_left
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from itertools import compress

import numpy as np

from tolstat.answers.allocate import optimizer
from tolstat.answers.allocate.fresh_runs import FreshRuns, Proof
from tolstat.answers.allocate.optimizer import Cheapest, Choice, DesignVariable
from tolstat.answers.allocate.reweighted_pool import MISS, Pool, with_choice
from tolstat.arrays import Array
from tolstat.execution.run_loop import Progress
from tolstat.execution.workers.block_scheduler import Interrupted
from tolstat.statistics.intervals.shares import anytime_valid
from tolstat.study.cost_entry import Shift
from tolstat.study.study_schema import MOST_SEED

WIDE = 0.5, 0.25, 0.25  # of the wide run: loosest, halfway, tightest
MOST_PROVED = 6  # allocations that are proved, the cheaper ones after the first as well
TIGHTER = 0.95  # of the fractions permitted, after each proof that failed
CHEAPER = 0.005  # than what is proved: worth another proof
MOST_STRETCHED = 3  # allocations that are proved by longer runs
WORTH = 0.01  # of the cost, that is worth one of these; half where all run at once
WIDER, NARROWER = 1.15, 2.0  # times all tolerances: the scales that are tried
SCALINGS = 12  # bisections between them
EVEN = 0.5  # chance that a fraction is larger: its median
TRIED = 101  # shifts of an entry
AT_END = 1e-6  # of a tolerance
LOOSER = 0.1  # of a tolerance: a step that shows which limit is active

CURVE = 2.0 ** np.arange(-4.5, 5.0, 1.5)  # times the fraction out of any limit
BISECTIONS = 5
FEWER = 100  # times fewer trials out of limit than on the curve


@dataclass(frozen=True)
class Point:
    """The cheapest tolerances for some fraction out of any limit, and their cost."""

    fraction_out_of_any_limit: float  # the median by weighted trials
    cost: float
    choice: Choice = field(metadata={"json": False})


class Search:
    """A search under way."""

    def __init__(self, runs: FreshRuns) -> None:
        study = runs.study
        self.runs, self.priced = runs, study.deviating.priced
        self.permitted = 1 - np.array([e.demanded for e in study.limits.values()])
        self.pool = Pool(study)
        self.variables = [
            DesignVariable(entry.cost, *entry.permitted, shift=True)
            if isinstance(entry, Shift)
            else DesignVariable(entry.cost, *entry.ends, len(entry.offered))
            for entry in self.priced
        ]
        self.specified = tuple(entry.specified_choice for entry in self.priced)
        self.tightest, self.loosest = (
            runs.as_written(end)
            for end in zip(*(entry.ends for entry in self.priced), strict=True)
        )
        self.shifts = [i for i, v in enumerate(self.variables) if v.shift]
        self.at_tightest: Proof | None = None  # that does not meet every limit
        self.failed: list[Proof] = []  # that do not
        self.exhaustive = True  # whether all combinations of lists were tried
        self.wide_trials = 0
        self.seed = study.seed or 0

    def run_wide(self) -> None:
        """Evaluate the wide run, the loosest tolerances all over the shifts."""
        loosest = tuple(entry.ends[1] for entry in self.priced)
        sets = loosest, self._halfway, self.tightest
        for choice, share in zip(sets, WIDE, strict=True):
            self._widen(choice, math.ceil(share * self.runs.trials))
        excess = self.above(self.permitted)
        if self.shifts and np.any(excess(self.tightest) > 0):
            self.centre(excess)

    @property
    def _halfway(self) -> Choice:
        """Tolerances halfway, with the shifts of the tightest."""
        return tuple(
            0.5 * sum(entry.ends)
            if entry.law
            else (x if i in self.shifts else float(len(entry.offered) // 2))
            for i, (entry, x) in enumerate(zip(self.priced, self.tightest, strict=True))
        )

    def centre(self, excess: Callable[[Choice], Array]) -> None:
        """Shift the tightest tolerances, one by one, to where least is out of limit."""
        for i in self.shifts:
            before, after = self.tightest[:i], self.tightest[i + 1 :]
            ends = self.variables[i].tightest, self.variables[i].loosest
            tried = [(*before, x, *after) for x in np.linspace(*ends, TRIED).tolist()]
            least = min(tried, key=lambda choice: float(np.max(excess(choice))))
            self.tightest = self.runs.as_written(least)

    def proved(self) -> Proof | None:
        """Return the cheapest proof, after searching and proving in turn."""
        best: Proof | None = None
        start = self._halfway if self.shifts else None
        times = 1.0
        for number in range(1, MOST_PROVED + 1):
            self.runs.tell(Progress(0, 0, 0, f"search {number}"))
            excess = self.above(times * self.permitted)
            solved = optimizer.cheapest(self.variables, excess, start)
            if solved is None and (best or self.at_tightest):
                break
            # where weights show nothing that meets the limits, a run may
            choice = self.runs.as_written(solved.choice) if solved else self.tightest
            self.exhaustive &= solved is None or solved.exhaustive
            if best and self.runs.cost(choice) >= (1 - CHEAPER) * best.scheme.cost:
                break
            if choice in [proof.choice for proof in self.failed]:
                times *= TIGHTER
                continue
            start, proof = choice, self._prove(choice, self.runs.longest)
            if proof.met:
                best, times = proof, 1.0
                continue
            times *= TIGHTER
            if choice == self.tightest:
                self.at_tightest = proof
        return best

    def stretched(
        self, choices: Iterable[Choice], best: Proof | None, longest: int
    ) -> Proof | None:
        """Return the best proof, after scaling choices by one factor for a longer run.

        Weights of all or nothing show little about many tolerances at once. They show
        much about one scale around the sampled trials. The earlier best
        proof is included.
        """
        less = WORTH if self.runs.study.model.integrates else WORTH / 2

        def worth(choice: Choice) -> bool:
            return not best or self.runs.cost(choice) < (1 - less) * best.scheme.cost

        wide = {choice: self._scaled(choice, WIDER) for choice in choices}
        ways = [choice for choice, wider in wide.items() if worth(wider)]
        for way in ways:
            self._widen(wide[way], self.runs.trials)
        aimed = np.array([_aimed(longest, share) for share in self.permitted])
        for _ in range(MOST_STRETCHED):
            self.runs.tell(Progress(0, 0, 0, "common scale"))
            scaled = [self._along(way, aimed) for way in ways]
            choice = min(filter(None, scaled), key=self.runs.cost, default=None)
            if choice is None or not worth(choice):
                break
            proof = self._prove(choice, longest)
            if proof.met:
                best = proof
        return best

    def _along(self, way: Choice, shares: Array) -> Choice | None:
        """Return tolerances scaled to these median fractions out of limit."""
        excess = self._excess(slice(None, -1), shares, EVEN, exact=True)
        tight, loose, best = 1 / NARROWER, WIDER, None
        for _ in range(SCALINGS):
            scale = math.sqrt(tight * loose)
            choice = self.runs.as_written(self._scaled(way, scale))
            if np.all(excess(choice) <= 0):
                tight, best = scale, choice
            else:
                loose = scale
        return best

    def _scaled(self, choice: Choice, scale: float) -> Choice:
        """Return scaled tolerances, within their ends; those of a list stay."""
        return tuple(
            min(max(x + math.log(scale), e.ends[0]), e.ends[1]) if e.law else x
            for e, x in zip(self.priced, choice, strict=True)
        )

    def _prove(self, choice: Choice, longest: int) -> Proof:
        proof = self.runs.prove(choice, self.next_seed(), most=longest)
        self.pool.add(choice, proof.scheme.seed, proof.out_of_limit)
        if not proof.met:
            self.failed.append(proof)
        return proof

    def _widen(self, choice: Choice, trials: int) -> None:
        """Add trials with some tolerances to those that are weighted."""
        seed = self.next_seed()
        study = with_choice(self.runs.study, choice, seed, trials)
        self.pool.add(choice, seed, self.runs.out_of_limit(study))
        self.wide_trials += trials

    def next_seed(self) -> int:
        """Return the seed of the next run, different from all others."""
        seed, self.seed = self.seed, (self.seed + 1) % (MOST_SEED + 1)
        return seed

    def above(self, shares: Array) -> Callable[[Choice], Array]:
        """Return log ratios of upper ends of fractions out of limit to some others."""
        return self._excess(slice(None, -1), shares, MISS)

    def cheapest_for(self, share: float, start: Choice) -> Cheapest | None:
        """Return the cheapest tolerances with a median fraction out of any limit."""
        excess = self._excess(slice(-1, None), np.array([share]), EVEN)
        return optimizer.cheapest(self.variables, excess, start)

    def out_of_any_limit(self, choice: Choice) -> float:
        """Return the median of the fraction out of any limit."""
        return float(self.pool.upper_ends(choice, EVEN)[-1])

    def _excess(
        self, limits: slice, shares: Array, miss: float, *, exact: bool = False
    ) -> Callable[[Choice], Array]:
        def excess(choice: Choice) -> Array:
            if self.runs.workers.stopping():
                raise Interrupted
            ends = self.pool.upper_ends(choice, miss, exact=exact)
            return np.log(ends[limits] / shares)

        return excess

    def active_limits(self, choice: Choice) -> tuple[str, ...]:
        """Return the limits that a step looser of some tolerance would break.

        The step is a tenth, as far as it may be, or the next option of a list.
        """
        broken = np.zeros(len(self.permitted), np.bool_)
        excess = self.above(self.permitted)
        for i, (entry, x) in enumerate(zip(self.priced, choice, strict=True)):
            if i not in self.shifts and not self.at_loosest(i, x):
                step = min(x + math.log(1 + LOOSER), entry.ends[1])
                looser = step if entry.law else x - 1
                broken |= excess((*choice[:i], looser, *choice[i + 1 :])) > 0
        return tuple(compress(self.runs.study.limits, broken.tolist()))

    def at_loosest(self, entry: int, choice: float) -> bool:
        """Return whether a tolerance is as loose as it may be, and can be written."""
        end, law = self.loosest[entry], self.priced[entry].law
        if entry in self.shifts:
            return False
        return choice > end - AT_END if law else choice == end


def _aimed(trials: int, permitted: float) -> float:
    """Return the fraction that so many trials are likely to show to be permitted.

    One standard error below the most that they can.
    """
    counts = range(math.ceil(permitted * trials))
    count = bisect_left(
        counts, True, key=lambda n: anytime_valid(n, trials).upper > permitted
    )
    return max(count - 1 - math.sqrt(count), 0.5) / trials


def points_about(search: Search, start: Choice) -> list[Point]:
    """Return the cheapest tolerances for fractions around that of an allocation."""
    points, reference = [], search.out_of_any_limit(start)
    search.runs.tell(Progress(0, 0, 0, "trade-off"))
    for times in CURVE[::-1]:
        share = min(float(times) * reference, 1.0)
        if solved := search.cheapest_for(share, start):
            start = solved.choice
            points.append(Point(share, search.runs.cost(start), start))
    return points


def own_fractions(search: Search, points: list[Point]) -> list[Point]:
    """Return each set of tolerances once, at the fraction out of limit of that set.

    One set of options of lists is the cheapest for many fractions.
    """
    return [
        replace(point, fraction_out_of_any_limit=search.out_of_any_limit(choice))
        for choice, point in {point.choice: point for point in points}.items()
    ]


def at_equal_cost(search: Search, points: list[Point], seed: int) -> Proof:
    """Return a run of the best tolerances for the drawing's cost, or of the drawing's.

    It is the drawing's run if a run does not confirm the weighted trials.
    """
    choices = for_equal_cost(search, points), search.specified
    proofs = (search.runs.prove(choice, seed) for choice in choices)
    return min(proofs, key=lambda p: p.scheme.fraction_out_of_any_limit.value)


def for_equal_cost(search: Search, points: list[Point]) -> Choice:
    """Find the tolerances with the fewest out of limit for the cost of the drawing."""
    runs = search.runs
    cost = runs.cost(search.specified)
    least, best = search.out_of_any_limit(search.specified), search.specified
    shares = [point.fraction_out_of_any_limit for point in points]
    for share, point in zip(shares, points, strict=True):
        written = runs.as_written(point.choice)
        if share < least and runs.cost(written) <= cost:
            least, best = share, written
    high = math.log(least)
    fewer = [share for share in shares if share < least]
    low = math.log(max(fewer)) if fewer else high - math.log(FEWER)
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        solved = search.cheapest_for(math.exp(middle), best)
        if solved and runs.cost(written := runs.as_written(solved.choice)) <= cost:
            best, high = written, middle
        else:
            low = middle
    return best
