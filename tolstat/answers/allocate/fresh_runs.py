"""Fresh runs of tolerances that are chosen: what they cost, what they put beyond."""

from __future__ import annotations

import math
import tomllib
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.answers.allocate.allocation import Scheme
from tolstat.answers.allocate.optimizer import Choice
from tolstat.answers.allocate.reweighted_pool import beyond_each
from tolstat.execution.run_loop import Progress, Telling
from tolstat.execution.trial_table import Trials
from tolstat.execution.workers.crew import Interrupted, Workers
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.limits.yields import MET, NOT_MET, Yield, joint_yield, yield_of
from tolstat.statistics.sample import Sample
from tolstat.study.cost_entry import tolerance_words, with_tolerances
from tolstat.study.given_points import Case
from tolstat.study.study import Study, load
from tolstat.units.scale import KNOWN

Bools = NDArray[np.bool_]

WITHIN = (0.0, 0.0)  # of a number that is 1 beyond a limit
LONGEST = 4  # times as many trials as a fresh run begins with
GROWTH = 1.25  # of a run whose verdicts are not settled, at least


class Proof(NamedTuple):
    """A fresh run of some tolerances.

    Attributes
    ----------
    choice : tuple of float
        Of them.
    scheme : Scheme
        What they cost, and how many machines they put beyond.
    yields : dict of str to Yield
        Of each limit.
    beyond : bool[limit, trial]
        Which machines are beyond each limit, or failed.
    status : uint8[trial]
        Of the machines.
    """

    choice: Choice
    scheme: Scheme
    yields: dict[str, Yield]
    beyond: Bools
    status: NDArray[np.uint8]

    @property
    def met(self) -> bool:
        """Whether it shows that every limit is met."""
        return all(each.verdict == MET for each in self.yields.values())


class FreshRuns:
    """The fresh runs of one allocation: what was run once is remembered.

    Parameters
    ----------
    study : Study
        Whose lines have costs.
    workers : Workers
        Who evaluate.
    trials : int
        Of a run at its first look.
    tell : callable
        Told of the progress.
    """

    def __init__(
        self, study: Study, workers: Workers, trials: int, tell: Telling
    ) -> None:
        self.study, self.workers, self.trials, self.tell = study, workers, trials, tell
        self.priced = study.deviating.priced
        self.longest = LONGEST * trials
        self._known: dict[tuple[Choice, int], Proof] = {}

    @property
    def made(self) -> tuple[int, ...]:
        """How many trials each run has, in the order in which they were begun."""
        return tuple(each.scheme.trials for each in self._known.values())

    def cost(self, choice: Choice) -> float:
        """Return the price of all parts with the tolerances of a choice."""
        pairs = zip(self.priced, choice, strict=True)
        return _typed(math.fsum(each.cost(x) for each, x in pairs))

    def text(self, choice: Choice, heading: str = "") -> str:
        """Return the study with the tolerances of a choice, as a file.

        Lines that are as drawn stay as they are.
        """
        words = self._words(choice)
        pairs = zip(self.priced, choice, strict=True)
        other = {e.name: words[e.name] for e, x in pairs if not e.is_drawn(x)}
        return with_tolerances(self.study.text, other, heading)

    def as_written(self, choice: Choice) -> Choice:
        """Return the choice that a file holds, whose digits are few."""
        return tuple(each.as_drawn for each in self._written(choice).deviating.priced)

    def of(self, choice: Choice, seed: int, *, least: int = 0, most: int = 0) -> Proof:
        """Run some tolerances afresh, but for machines that were run before.

        Parameters
        ----------
        choice : tuple of float
            As it is written.
        seed : int
            Of the run.
        least : int
            Trials that it has at least.
        most : int
            Trials to which it is extended while its verdicts are not settled.
        """
        known, limits = self._known.get((choice, seed)), self.study.limits
        beyond = known.beyond if known else np.zeros((len(limits), 0), np.bool_)
        status = known.status if known else np.zeros(0, np.uint8)
        count = max(self.trials, least, len(status))
        answer = self._written(choice)
        while True:
            if len(status) < count:
                run = self._run(answer, seed, len(status), count)
                beyond = np.hstack([beyond, beyond_each(limits, run)])
                status = np.hstack([status, run.status])
            sample = Sample(status)
            # of what machines answer no more is kept: 1 beyond the limit, 0 within
            told = dict(zip(limits, beyond.astype(np.float64), strict=True))
            yields = {
                name: yield_of(told[name], sample, WITHIN, each.demanded)
                for name, each in limits.items()
            }
            verdicts = {each.verdict for each in yields.values()}
            settled = verdicts == {MET} or NOT_MET in verdicts
            if settled or count >= most:
                break
            wanted = max(each.needed or most for each in yields.values())
            count = min(max(wanted, math.ceil(GROWTH * count)), most)
        joint = joint_yield(told, sample, dict.fromkeys(limits, WITHIN))
        scheme = self._scheme(choice, yields, joint.complement, count, seed)
        proof = Proof(choice, scheme, yields, beyond, status)
        self._known[choice, seed] = proof
        return proof

    def evaluate(self, study: Study, run: Trials, doing: str) -> None:
        """Evaluate the machines of a run."""
        asked = len(run.status)
        cases = [Case(0, asked, study.settings)]
        for blocks in self.workers.blocks(study.model, cases, run.deviations):
            run.take(blocks)
            self.tell(Progress(run.over, run.failed, asked, doing))
        if run.over < asked:
            raise Interrupted

    def _run(self, answer: Study, seed: int, first: int, stop: int) -> Trials:
        """Run some of the random machines of a study."""
        study = answer.at_random(seed, stop)
        run = Trials.planned(study.description, study.deviations()[first:])
        self.evaluate(study, run, "fresh run")
        return run

    def _scheme(
        self,
        choice: Choice,
        yields: dict[str, Yield],
        beyond_any: Estimate,
        trials: int,
        seed: int,
    ) -> Scheme:
        pairs = zip(self.priced, choice, strict=True)
        return Scheme(
            self.cost(choice),
            self._words(choice),
            {each.name: _typed(each.half(x)) for each, x in pairs},
            {name: each.out_of_limit for name, each in yields.items()},
            beyond_any,
            trials,
            seed,
        )

    def _words(self, choice: Choice) -> dict[str, str]:
        pairs = zip(self.priced, choice, strict=True)
        return {each.name: tolerance_words(each, x) for each, x in pairs}

    def _written(self, choice: Choice) -> Study:
        """Return the study with some tolerances, read from the file it would be."""
        folder = self.study.path.parent if self.study.path else None
        table = tomllib.loads(self.text(choice))
        return load(table, model=self.study.model, folder=folder)


def _typed(x: float) -> float:
    """Return what was typed, without what logarithms and sums add to it."""
    return float(f"{x:.{KNOWN}g}")
