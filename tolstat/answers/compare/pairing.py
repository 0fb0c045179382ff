"""How two runs are paired: the same trials, common random numbers, or unpaired."""

import math
from dataclasses import dataclass, field

import numpy as np

from tolstat.answers.sampled_trials import Drawn, drawn_trials, no_sample
from tolstat.arrays import Array
from tolstat.errors import QuestionError
from tolstat.literal import some_of
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.limits.yields import Caveat
from tolstat.statistics.sample import Sample
from tolstat.statistics.sensitivity.out_of_limit import CHANCE
from tolstat.status import Status
from tolstat.store.stored_run import Run

TRIALS, NUMBERS, UNPAIRED = "same trials", "common random numbers", "unpaired"
NOT_PAIRED = Estimate(math.nan, reason=UNPAIRED)
ROUNDING = 1e-9  # of the range of a part: smaller changes of order are ignored
NAMED = 6  # contributors in a sentence
NOT_IN_JSON = {"json": False}


@dataclass(frozen=True)
class Pairing:
    """How a design is paired with the first."""

    kind: str  # "same trials", "common random numbers" or "unpaired"
    words: str  # how that was found
    trials: int  # in both runs; 0 of unpaired ones, as are the next two
    done_in_both: int
    failed: int  # in either
    failures: Estimate  # fraction that failed
    promise: str  # what the intervals hold for
    first: Drawn = field(metadata=NOT_IN_JSON)
    second: Drawn = field(metadata=NOT_IN_JSON)
    # the first trials, as many as both have, done where they are in both; or None
    sample: Sample | None = field(metadata=NOT_IN_JSON)
    responses: tuple[str, ...] = field(
        metadata=NOT_IN_JSON
    )  # of both, as the first has them

    @property
    def paired(self) -> bool:
        """Whether the trials of both are the same, or have common random numbers."""
        return self.sample is not None

    def values(self, response: str) -> tuple[Array, Array]:
        """Return a response in both, SI: of the trials that are compared."""
        n = self.trials or None
        return self.first.values(response)[:n], self.second.values(response)[:n]

    def done(self, response: str) -> tuple[Array, Array]:
        """Return the same of those that are done: in both, or each in its own run."""
        if self.sample is None:
            return self.first.done(response), self.second.done(response)
        first, second = self.values(response)
        return first[self.sample.done], second[self.sample.done]


def pair_of(first: Run, second: Run) -> Pairing:
    """Return two runs and how they are paired.

    A sample depends on the seed, the sampling, the number of the trial and the name of
    the contributor. So two studies with other tolerances have common random numbers:
    the order of all deviations of a part is the same in both runs. Chance does not
    produce it with twenty trials or more. This order is checked.

    Raises
    ------
    QuestionError
        If they are runs of two models, trials were not sampled, no response is in
        both, or no trial is done.
    """
    A, B = drawn_trials(first), drawn_trials(second)
    where = f"{first.path} and {second.path}"
    if first.model != second.model:
        raise QuestionError(
            f"{where} are of two models, {first.model} and {second.model}; runs of "
            "one model can be compared"
        )
    if A is None or B is None:
        raise no_sample(second if A else first)
    names = tuple(
        response.name
        for response in first.responses
        if second.units.get(response.name) == response.unit
    )
    if not names:
        raise QuestionError(f"{where} have no response in common")
    common = min(len(A.trials), len(B.trials))
    kind, words = _together(A, B, common)
    if kind == UNPAIRED:
        for drawn in (A, B):
            if not drawn.sample.done.any():
                raise QuestionError(f"{drawn.run.path}: no trial is done")
        sample, counts, failures = None, (0, 0, 0), NOT_PAIRED
    else:
        sample = _in_both(A.sample.first(common), B.sample.first(common))
        if not sample.done.any():
            raise QuestionError(f"{where}: no trial is done in both")
        if len(A.trials) != len(B.trials):
            words += f"; of both the first {common} trials"
        counts = common, int(np.count_nonzero(sample.done)), sample.failed
        failures = sample.failures
    for run in (first, second):
        if run.thinned:
            words += f"; of {run.path.name} the first {run.random_trials} trials, which"
            words += " are random; fractions out of limit rest on thinned ones, too"
            words += f", {Caveat.MISSED_KIND}" * run.thinned.skips
    if sample and (first.thinned or second.thinned):
        words += "; their difference is 0 where limit and random trials are equal"
    promise = A.sampled.promise
    if A.run.sampling == "random":  # anytime-valid ones of verdicts are not shown
        promise = "of quantiles exact, as random trials are independent"
    promise += "; of fractions and Ppk for a single look"
    if first.stopped or second.stopped:
        promise += ", or for any number of trials where a run chose it"
    return Pairing(kind, words, *counts, failures, promise, A, B, sample, names)


def _in_both(a: Sample, b: Sample) -> Sample:
    """Return the trials of two runs: done where they are in both."""
    # how a trial failed does not matter here
    ran = np.where(a.ran & b.ran, Status.NOT_FINITE, Status.NOT_RUN)
    return Sample(np.where(a.done & b.done, Status.DONE, ran), a.replicates)


def _together(A: Drawn, B: Drawn, common: int) -> tuple[str, str]:
    """Return how the first trials of two runs are paired, and the evidence."""
    for design in (A, B):
        if design.sample.weights:
            return UNPAIRED, f"trials of {design.run.path.name} are weighted"
    for origin, a, b in (
        ("seeds", A.sampled.seed, B.sampled.seed),
        ("samplings", A.run.sampling, B.run.sampling),
    ):
        if a != b:
            return UNPAIRED, f"{origin} {a} and {b}"
    parts = [[part.name for part in drawn.run.contributors] for drawn in (A, B)]
    columns = {
        name: [
            drawn.values(name)[:common] if name in names else np.zeros(common)
            for drawn, names in zip((A, B), parts, strict=True)
        ]
        for name in dict.fromkeys(parts[0] + parts[1])
    }
    other = [n for n, (a, b) in columns.items() if np.any(a != b)]
    if not columns:
        return UNPAIRED, "no part is known"
    if not other:
        return TRIALS, "every deviation is the same in both, to the last bit"
    varying = [n for n, both in columns.items() if all(np.ptp(x) > 0 for x in both)]
    if not varying:
        return UNPAIRED, "no part deviates in both"
    reordered = [n for n in varying if not _same_order(*columns[n])]
    if not any(n not in reordered or _correlated(*columns[n]) for n in varying):
        seed = "" if A.run.listed else "one seed, but "
        return UNPAIRED, f"{seed}no part has the same order of deviations"
    words = f"the order of all {common} deviations of a part is the same in both; "
    words += f"widths differ: {some_of(other, NAMED)}"
    if reordered:
        words += f"; another order, of correlated parts: {some_of(reordered, NAMED)}"
    return NUMBERS, words


def _same_order(a: Array, b: Array) -> bool:
    """Tell whether one order sorts both: the same unit samples made them."""
    drops = np.diff(b[np.lexsort((b, a))])
    return bool(drops.min(initial=0.0) >= -ROUNDING * np.ptp(b))


def _correlated(a: Array, b: Array) -> bool:
    """Tell whether ranks are correlated by more than chance."""
    ranks = [np.argsort(np.argsort(values)) for values in (a, b)]
    r = float(np.asarray(np.corrcoef(ranks))[0, 1])
    return abs(r) > CHANCE / math.sqrt(len(a))
