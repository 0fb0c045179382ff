"""Fresh runs of tolerances: their costs, and their fractions out of limit."""

import math
import tomllib
from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np

from tolstat.answers.allocate.optimizer import Choice
from tolstat.arrays import Array, Truths
from tolstat.deviations.spread import half_of
from tolstat.execution.run_loop import Telling, evaluate_stages
from tolstat.execution.stages import SampledStages, Stage, Trials
from tolstat.execution.workers.block_scheduler import Workers
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.limits.limit import Limit, within
from tolstat.statistics.limits.yields import MET, NOT_MET, Yield, joint_yield, yield_of
from tolstat.statistics.sample import Sample
from tolstat.status import Status
from tolstat.study.cost_entry import Priced, Shift
from tolstat.study.given_points import Case
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
        return {limit.verdict for limit in self.yields.values()} == {MET}


class UntilSettled:
    """Stages of random trials, until each limit is met, or one of them is not.

    Attributes
    ----------
    out_of_limit : bool[limit, trial]
        Which trials are out of each limit, or failed: 1 or 0 is all that is kept of a
        response.
    yields : dict of str to Yield
        By limit, at the last look.
    """

    def __init__(
        self, study: Study, seed: int, before: Truths, *, first_look: int, most: int
    ) -> None:
        self._study, self._seed, self._before = study, seed, before
        self._first_look, self._most = first_look, most
        self.out_of_limit = before
        self.yields: dict[str, Yield] = {}

    def next(self, trials: Trials) -> Stage | None:
        """Return as many trials as seem to settle the verdicts, `most` at most."""
        limits, earlier = self._study.limits, self._before.shape[1]
        if trials.sampled:
            out = out_of_each_limit(limits, trials)
            self.out_of_limit = np.hstack([self._before, out])
        count = self.out_of_limit.shape[1]
        length = max(self._first_look, count)
        if count == length:
            flags, sample = self.flags, self.sample
            self.yields = {
                name: yield_of(flags[name], sample, WITHIN, limit.demanded)
                for name, limit in limits.items()
            }
            verdicts = {limit.verdict for limit in self.yields.values()}
            if verdicts == {MET} or NOT_MET in verdicts or count >= self._most:
                return None
            needed = max(limit.needed or self._most for limit in self.yields.values())
            length = min(max(needed, math.ceil(GROWTH * count)), self._most)
        rows = self._study.at_random(self._seed, length).deviations()[count:]
        cases = (Case(0, length - earlier, self._study.settings),)
        return Stage(count - earlier, rows, cases)

    @property
    def sample(self) -> Sample:
        """The sample of all trials: failed ones are flagged out of limit."""
        return Sample(np.full(self.out_of_limit.shape[1], Status.DONE, np.uint8))

    @property
    def flags(self) -> dict[str, Array]:
        """1 of each trial out of limit, else 0: float64[trial] by limit."""
        numbers = self.out_of_limit.astype(np.float64)
        return dict(zip(self._study.limits, numbers, strict=True))


class FreshRuns:
    """The fresh runs of one allocation, none made twice; `trials` at a first look."""

    def __init__(
        self, study: Study, workers: Workers, trials: int, tell: Telling
    ) -> None:
        self.study, self.workers, self.trials, self.tell = study, workers, trials, tell
        self.priced = study.deviating.priced
        self.longest = LONGEST * trials
        self._proofs: dict[tuple[Choice, int], Proof] = {}

    @property
    def lengths(self) -> tuple[int, ...]:
        """How many trials each run has, in the order in which they were begun."""
        return tuple(proof.scheme.trials for proof in self._proofs.values())

    def cost(self, choice: Choice) -> float:
        """Return the price of all parts with the tolerances of a choice."""
        return _typed(math.fsum(entry.cost(x) for entry, x in self._chosen(choice)))

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
        return tuple(entry.specified_choice for entry in written)

    def prove(self, choice: Choice, seed: int, *, most: int = 0) -> Proof:
        """Return a fresh run of a choice as written; its earlier trials are kept.

        It gets more trials, up to `most`, until its verdicts are settled.
        """
        before = self._proofs.get((choice, seed))
        none = np.zeros((len(self.study.limits), 0), np.bool_)
        out = before.out_of_limit if before else none
        study = self.written(choice)
        until = UntilSettled(study, seed, out, first_look=self.trials, most=most)
        nothing = np.zeros((0, len(study.description.contributors)))
        begun = Trials.planned(study.description, nothing)
        evaluate_stages(
            study.model, until, begun, self.workers, self.tell, doing="fresh run"
        )
        chosen = [*self._chosen(choice)]
        tolerances = {entry.name: entry.text(x) for entry, x in chosen}
        half_widths = {
            entry.name: _typed(half_of(entry.distributions(x)))
            for entry, x in chosen
            if not isinstance(entry, Shift)
        }
        shares = {n: y.fraction_out_of_limit for n, y in until.yields.items()}
        within_all = joint_yield(
            until.flags, until.sample, dict.fromkeys(shares, WITHIN)
        )
        out = until.out_of_limit
        scheme = Scheme(
            self.cost(choice), tolerances, half_widths,
            fraction_out_of_limit=shares,
            fraction_out_of_any_limit=within_all.complement,
            trials=out.shape[1], seed=seed,
        )  # fmt: skip
        proof = Proof(choice, scheme, until.yields, out)
        self._proofs[choice, seed] = proof
        return proof

    def out_of_limit(self, study: Study) -> Truths:
        """Return which trials are out of each limit, or failed: bool[limit, trial]."""
        stages = SampledStages(study)
        evaluate_stages(
            study.model, stages, stages.trials, self.workers, self.tell,
            doing="wide run",
        )  # fmt: skip
        return out_of_each_limit(study.limits, stages.trials)

    def _chosen(self, choice: Choice) -> Iterable[tuple[Priced, float]]:
        return zip(self.priced, choice, strict=True)

    def written(self, choice: Choice) -> Study:
        """Return the study with some tolerances, read from the file it would be."""
        folder = self.study.path.parent if self.study.path else None
        table = tomllib.loads(self.study_text(choice))
        return load(table, model=self.study.model, folder=folder)


def out_of_each_limit(limits: Mapping[str, Limit], trials: Trials) -> Truths:
    """Return which trials are out of each limit, or failed: bool[limit, trial]."""
    pairs = ((trials.response(name), limit) for name, limit in limits.items())
    return np.array([~within(values, limit.permitted) for values, limit in pairs])


def _typed(x: float) -> float:
    """Return a typed number, without rounding errors of logarithms and sums."""
    return float(f"{x:.{KNOWN}g}")
