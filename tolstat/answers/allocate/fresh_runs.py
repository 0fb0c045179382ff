"""Fresh runs of tolerances: their costs, and their fractions out of limit."""

import math
import tomllib
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from tolstat.answers.allocate.optimizer import Choice
from tolstat.arrays import Array, Truths
from tolstat.deviations.spread import half_of
from tolstat.execution.run_loop import Progress, Telling
from tolstat.execution.trial_table import Trials
from tolstat.execution.workers.crew import Interrupted, Workers
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.limits.limit import Limit, within
from tolstat.statistics.limits.yields import MET, NOT_MET, Yield, joint_yield, yield_of
from tolstat.statistics.sample import Sample
from tolstat.status import Status
from tolstat.study.cost_entry import Priced
from tolstat.study.given_points import Case
from tolstat.study.shift_entry import Shift
from tolstat.study.study import Study, load
from tolstat.units.scale import KNOWN

WITHIN = (0.0, 0.0)  # of a number that is 1 out of limit
LONGEST = 4  # times as many trials as a fresh run begins with
GROWTH = 1.25  # of a run whose verdicts are not settled, at least


class Scheme(NamedTuple):
    """Tolerances, their cost, and fractions out of limit in a fresh run."""

    cost: float  # of all parts that have one
    tolerances: dict[str, str]  # by entry of the study, as written; and shifts
    half_widths: dict[str, float]  # half their widths, SI
    fraction_out_of_limit: dict[str, Estimate]  # by limit
    fraction_out_of_any_limit: Estimate
    trials: int  # of the fresh run
    seed: int


class Proof(NamedTuple):
    """A fresh run of some tolerances."""

    choice: Choice  # of the tolerances
    scheme: Scheme
    yields: dict[str, Yield]  # by limit
    out_of_limit: Truths  # [limit, trial], failed trials too

    @property
    def met(self) -> bool:
        """Whether it shows that every limit is met."""
        return all(each.verdict == MET for each in self.yields.values())


class FreshRuns:
    """The fresh runs of one allocation, none made twice; `trials` at a first look."""

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
        return _typed(math.fsum(each.cost(x) for each, x in self._chosen(choice)))

    def study_text(self, choice: Choice, **keys: Any) -> str:
        """Return the study with the tolerances of a choice, as a file."""
        editor = self.study.editor()
        for priced, x in self._chosen(choice):
            if not priced.is_specified(x):
                editor.change(priced.entry, priced.change(x))
        editor.table |= keys
        return editor.text

    def as_written(self, choice: Choice) -> Choice:
        """Return the choice that a file holds, whose digits are few."""
        written = self.written(choice).deviating.priced
        return tuple(each.specified_choice for each in written)

    def of(self, choice: Choice, seed: int, *, most: int = 0) -> Proof:
        """Return a fresh run of a choice as written; its earlier trials are kept.

        It gets more trials, up to `most`, until its verdicts are settled.
        """
        known, limits = self._known.get((choice, seed)), self.study.limits
        out = known.out_of_limit if known else np.zeros((len(limits), 0), np.bool_)
        count = max(self.trials, out.shape[1])
        answer = self.written(choice)
        while True:
            if out.shape[1] < count:
                study = answer.at_random(seed, count)
                deviations = study.deviations()[out.shape[1] :]
                out = np.hstack([out, self.evaluate(study, deviations, "fresh run")])
            # all that is kept of a response: 1 out of limit or failed, 0 within
            sample = Sample(np.full(count, Status.DONE, np.uint8))
            flags = dict(zip(limits, out.astype(np.float64), strict=True))
            yields = {
                name: yield_of(flags[name], sample, WITHIN, each.demanded)
                for name, each in limits.items()
            }
            verdicts = {each.verdict for each in yields.values()}
            settled = verdicts == {MET} or NOT_MET in verdicts
            if settled or count >= most:
                break
            wanted = max(each.needed or most for each in yields.values())
            count = min(max(wanted, math.ceil(GROWTH * count)), most)
        tolerances, half_widths = {}, {}
        for each, x in self._chosen(choice):
            tolerances[each.name] = each.text(x)
            if not isinstance(each, Shift):
                half_widths[each.name] = _typed(half_of(each.distributions(x)))
        scheme = Scheme(
            self.cost(choice),
            tolerances,
            half_widths,
            {name: each.fraction_out_of_limit for name, each in yields.items()},
            joint_yield(flags, sample, dict.fromkeys(limits, WITHIN)).complement,
            count,
            seed,
        )
        proof = Proof(choice, scheme, yields, out)
        self._known[choice, seed] = proof
        return proof

    def evaluate(self, study: Study, deviations: Array, doing: str) -> Truths:
        """Return which trials are out of each limit, or failed: bool[limit, trial]."""
        run, number = Trials.planned(study.description, deviations), len(deviations)
        cases = [Case(0, number, study.settings)]
        for blocks in self.workers.blocks(study.model, cases, deviations):
            run.take(blocks)
            self.tell(Progress(run.over, run.failed, number, doing))
        if run.over < number:
            raise Interrupted
        return out_of_each_limit(study.limits, run)

    def _chosen(self, choice: Choice) -> Iterator[tuple[Priced, float]]:
        return zip(self.priced, choice, strict=True)

    def written(self, choice: Choice) -> Study:
        """Return the study with some tolerances, read from the file it would be."""
        folder = self.study.path.parent if self.study.path else None
        table = tomllib.loads(self.study_text(choice))
        return load(table, model=self.study.model, folder=folder)


def out_of_each_limit(limits: Mapping[str, Limit], trials: Trials) -> Truths:
    """Return which trials are out of each limit, or failed: bool[limit, trial]."""
    return np.array(
        [~within(trials.response(name), of.permitted) for name, of in limits.items()]
    )


def _typed(x: float) -> float:
    """Return a typed number, without rounding errors of logarithms and sums."""
    return float(f"{x:.{KNOWN}g}")
