"""The search for the cheapest tolerances: weighted machines find, fresh runs prove."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Callable, Iterable

import numpy as np
from numpy.typing import NDArray

from tolstat.answers.allocate.fresh_runs import FreshRuns, Proof
from tolstat.answers.allocate.optimizer import (
    Cheapest,
    Choice,
    DesignVariable,
    cheapest,
)
from tolstat.answers.allocate.reweighted_pool import (
    MISS,
    Pool,
    beyond_each,
    with_choice,
)
from tolstat.execution.run_loop import Progress
from tolstat.execution.trial_table import Trials
from tolstat.execution.workers.crew import Interrupted
from tolstat.statistics.limits.anytime_valid import anytime_valid
from tolstat.statistics.limits.yields import MET
from tolstat.study.study_schema import MOST_SEED

Array = NDArray[np.float64]

WIDE = (("loosest", 0.5), ("halfway", 0.25), ("tightest", 0.25))  # of the wide run
MOST_PROVED = 6  # allocations that are proved, the cheaper ones after the first as well
TIGHTER = 0.95  # of the shares permitted, after each that was not proved
CHEAPER = 0.005  # than what is proved, that another one is worth its proof
MOST_STRETCHED = 3  # allocations that are proved by longer runs
WORTH = 0.01  # of the cost, that is worth one of these; half where all run at once
WIDER, NARROWER = 1.15, 2.0  # times all tolerances: the scales that are looked at
SCALINGS = 12  # bisections between them
EVEN = 0.5  # as likely as not: of what is drawn, or proved for itself


class Searching:
    """A search under way.

    Parameters
    ----------
    runs : FreshRuns
        That prove what is found.
    """

    def __init__(self, runs: FreshRuns) -> None:
        study = runs.study
        self.runs, self.priced = runs, study.deviating.priced
        self.permitted = np.array([1 - each.demanded for each in study.limits.values()])
        self.pool = Pool(study)
        self.variables = [
            DesignVariable(each.cost, *each.ends, len(each.offered))
            for each in self.priced
        ]
        self.drawn: Choice = tuple(each.as_drawn for each in self.priced)
        self.tightest, self.loosest = (
            runs.as_written(end)
            for end in zip(*(each.ends for each in self.priced), strict=True)
        )
        self.at_tightest: Proof | None = None  # that does not meet every limit
        self.drawn_wide = 0  # machines of the wide run
        self.notes: list[str] = []
        self.seed = study.seed or 0

    def draw_wide(self) -> None:
        """Evaluate the wide run."""
        halfway = tuple(
            0.5 * sum(each.ends) if each.law else float(len(each.offered) // 2)
            for each in self.priced
        )
        loosest = tuple(each.ends[1] for each in self.priced)
        sets = {"loosest": loosest, "halfway": halfway, "tightest": self.tightest}
        for name, share in WIDE:
            self._draw(sets[name], math.ceil(share * self.runs.trials))

    def proved(self, best: Proof | None = None) -> Proof | None:
        """Search and prove in turn; return the cheapest that is proved.

        Parameters
        ----------
        best : Proof, optional
            That is known already: from it on.
        """
        vain: set[Choice] = set()
        start = best.choice if best else None
        every, times = True, 1.0
        for number in range(1, MOST_PROVED + 1):
            self.runs.tell(Progress(0, 0, 0, f"search {number}"))
            found = cheapest(self.variables, self.above(times * self.permitted), start)
            if found is None and (best or self.at_tightest):
                break
            # where weights show nothing that meets the limits, a run may
            choice = self.runs.as_written(found.choice) if found else self.tightest
            every = every and (found is None or found.every)
            if best and self.runs.cost(choice) >= (1 - CHEAPER) * best.scheme.cost:
                break
            if choice in vain:
                times *= TIGHTER
                continue
            proof = self._run(choice, self.runs.longest)
            start = choice
            if proof.met:
                best, times = proof, 1.0
                continue
            vain.add(choice)
            times *= TIGHTER
            if choice == self.tightest:
                self.at_tightest = proof
            else:
                self._note_vain(proof)
        if not every:
            self.notes.append(
                "too many combinations to try them all: tolerances were exchanged one "
                "or two at a time, so that a cheaper set may exist"
            )
        return best

    def stretched(
        self, choices: Iterable[Choice], best: Proof | None, longest: int
    ) -> Proof | None:
        """Scale tolerances in common to what a longer run is likely to show.

        Weights tell little of many tolerances at once where they are all or nothing,
        and much of one scale about which machines were drawn.

        Parameters
        ----------
        choices : iterable of tuple of float
            Whose proportions are kept.
        best : Proof, optional
            The best that is proved.
        longest : int
            Trials that a proof may take.

        Returns
        -------
        Proof or None
            The cheapest that is proved.
        """
        less = WORTH if self.runs.study.model.integrates else WORTH / 2

        def worth(choice: Choice) -> bool:
            return not best or self.runs.cost(choice) < (1 - less) * best.scheme.cost

        wide = {each: self._scaled(each, WIDER) for each in choices}
        ways = [each for each, wider in wide.items() if worth(wider)]
        for way in ways:
            self._draw(wide[way], self.runs.trials)
        aimed = np.array([_aimed(longest, each) for each in self.permitted])
        for _ in range(MOST_STRETCHED):
            self.runs.tell(Progress(0, 0, 0, "common scale"))
            scaled = [self._along(way, aimed) for way in ways]
            choice = min(filter(None, scaled), key=self.runs.cost, default=None)
            if choice is None or not worth(choice):
                break
            proof = self._run(choice, longest)
            if proof.met:
                best = proof
            else:
                self._note_vain(proof)
        return best

    def _along(self, way: Choice, shares: Array) -> Choice | None:
        """Scale tolerances until shares beyond are these, as likely as not."""
        excess = self._excess(slice(None, -1), shares, EVEN, exact=True)
        tight, loose, found = 1 / NARROWER, WIDER, None
        for _ in range(SCALINGS):
            scale = math.sqrt(tight * loose)
            choice = self.runs.as_written(self._scaled(way, scale))
            if np.all(excess(choice) <= 0):
                tight, found = scale, choice
            else:
                loose = scale
        return found

    def _scaled(self, choice: Choice, scale: float) -> Choice:
        """Scale tolerances that are not of a list, as far as they may be."""
        return tuple(
            min(max(x + math.log(scale), each.ends[0]), each.ends[1]) if each.law else x
            for each, x in zip(self.priced, choice, strict=True)
        )

    def _run(self, choice: Choice, longest: int) -> Proof:
        proof = self.runs.of(choice, self.next_seed(), most=longest)
        self.pool.add(choice, proof.scheme.seed, proof.beyond)
        return proof

    def _draw(self, choice: Choice, trials: int) -> None:
        seed = self.next_seed()
        study = with_choice(self.runs.study, choice, seed, trials)
        run = Trials.planned(study.description, study.deviations())
        self.runs.evaluate(study, run, "wide run")
        self.pool.add(choice, seed, beyond_each(study.limits, run))
        self.drawn_wide += trials

    def above(self, shares: Array) -> Callable[[Choice], Array]:
        """Return how far shares beyond each limit may be above some: a logarithm.

        Parameters
        ----------
        shares : float64[limit]
            That the upper ends of the intervals are to keep to.
        """
        return self._excess(slice(None, -1), shares, MISS)

    def cheapest_for(self, share: float, start: Choice) -> Cheapest | None:
        """Find the cheapest tolerances for a share beyond any limit, likely as not."""
        excess = self._excess(slice(-1, None), np.array([share]), EVEN)
        return cheapest(self.variables, excess, start)

    def beyond_any(self, choice: Choice) -> float:
        """Return the share beyond any limit that is exceeded as likely as not."""
        return float(self.pool.most(choice, EVEN)[-1])

    def _excess(
        self, of: slice, shares: Array, miss: float, *, exact: bool = False
    ) -> Callable[[Choice], Array]:
        def excess(choice: Choice) -> Array:
            if self.runs.workers.stopping():
                raise Interrupted
            return np.log(self.pool.most(choice, miss, exact=exact)[of] / shares)

        return excess

    def next_seed(self) -> int:
        """Return the seed of the next run, that no other one has."""
        seed, self.seed = self.seed, (self.seed + 1) % (MOST_SEED + 1)
        return seed

    def _note_vain(self, proof: Proof) -> None:
        said = ", ".join(
            f"{name}: {each.verdict}"
            for name, each in proof.yields.items()
            if each.verdict != MET
        )
        self.notes.append(
            f"found for {proof.scheme.cost:.4g}, and not shown by a fresh run of "
            f"{proof.scheme.trials} machines ({said}); searched again"
        )


def _aimed(trials: int, permitted: float) -> float:
    """Return the share beyond that so many trials are likely to show permitted.

    One standard error below the most that they can.
    """
    counts = range(math.ceil(permitted * trials))
    few = bisect_left(
        counts, True, key=lambda n: anytime_valid(n, trials).upper > permitted
    )
    return max(few - 1 - math.sqrt(few), 0.5) / trials
