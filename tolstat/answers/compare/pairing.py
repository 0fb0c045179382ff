"""How two runs are paired: the same trials, common random numbers, or unpaired."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.answers.sampled_trials import Drawn, drawn_trials, no_sample
from tolstat.errors import PictureError
from tolstat.statistics.sample import Sample
from tolstat.statistics.sensitivity.pairs import CHANCE
from tolstat.status import Status
from tolstat.store.stored_run import Run

Array = NDArray[np.float64]

TRIALS, NUMBERS, UNPAIRED = "same trials", "common random numbers", "unpaired"
ROUNDING = 1e-9  # of all deviations of a part: by less, an order is the same
NAMED = 6  # contributors in a sentence


class Pair(NamedTuple):
    """Two runs side by side.

    Attributes
    ----------
    first, second : Drawn
        The runs.
    kind : str
        "same trials", "common random numbers" or "unpaired".
    words : str
        How that was found, in a sentence.
    sample : Sample or None
        The first trials, as many as both have: done where they are in both; None of
        unpaired runs.
    responses : tuple of str
        Names that both runs have, in the order of the first.
    """

    first: Drawn
    second: Drawn
    kind: str
    words: str
    sample: Sample | None
    responses: tuple[str, ...]

    def values(self, response: str) -> tuple[Array, Array]:
        """Return a response in both, SI: of the trials that are compared."""
        n = None if self.sample is None else len(self.sample.status)
        return self.first.values(response)[:n], self.second.values(response)[:n]

    def done(self, response: str) -> tuple[Array, Array]:
        """Return the same of those that are done: in both, or each in its own run."""
        if self.sample is None:
            return self.first.done(response), self.second.done(response)
        first, second = self.values(response)
        return first[self.sample.done], second[self.sample.done]


def pair_of(first: Run, second: Run) -> Pair:
    """Put two runs side by side, and find out how they are paired.

    A sample depends on the seed, the sampling, the number of the trial and the name of
    the contributor. So two studies with other tolerances have common random numbers:
    the order of all deviations of a part is the same in both runs, which chance makes
    of no twenty trials. This order is checked.

    Returns
    -------
    Pair
        With the responses that both have. Of runs that are paired the first trials, as
        many as both have.

    Raises
    ------
    PictureError
        If they are runs of two models, trials were not sampled, no response is in
        both, or no trial is done.
    """
    A, B = drawn_trials(first), drawn_trials(second)
    where = f"{first.path} and {second.path}"
    if first.model != second.model:
        raise PictureError(
            f"{where} are of two models, {first.model} and {second.model}; runs of "
            "one model can be compared"
        )
    if A is None or B is None:
        raise no_sample(second if A else first)
    units = second.units
    names = tuple(
        each.name for each in first.responses if units.get(each.name) == each.unit
    )
    if not names:
        raise PictureError(f"{where} have no response in common")
    common = min(len(A.trials), len(B.trials))
    kind, words = _together(A, B, common)
    if kind == UNPAIRED:
        for each in (A, B):
            if not each.sample.done.any():
                raise PictureError(f"{each.run.path}: no trial is done")
        return Pair(A, B, kind, words, None, names)
    samples = [each.sample.first(common) for each in (A, B)]
    done, ran = (
        np.logical_and(*each)
        for each in ([s.done for s in samples], [s.ran for s in samples])
    )
    if not done.any():
        raise PictureError(f"{where}: no trial is done in both")
    # how the trial failed does not matter here
    status = np.where(done, Status.DONE, np.where(ran, Status.NOT_FINITE, 0))
    if len(A.trials) != len(B.trials):
        words += f"; of both the first {common} trials"
    return Pair(A, B, kind, words, Sample(status, A.sample.replicates), names)


def _together(A: Drawn, B: Drawn, common: int) -> tuple[str, str]:
    """Tell how the first trials of two runs are paired, and how that is known."""
    runs = (A.run, B.run)
    for what, values in (
        ("seeds", [each.sampled.seed for each in (A, B)]),
        ("samplings", [run.sampling for run in runs]),
    ):
        if values[0] != values[1]:
            return UNPAIRED, f"{what} {values[0]} and {values[1]}"
    known = [{each.name for each in run.contributors} for run in runs]
    columns = {
        each.name: [
            drawn.values(each.name)[:common] if each.name in names else np.zeros(common)
            for drawn, names in zip((A, B), known, strict=True)
        ]
        for run in runs
        for each in run.contributors
    }
    other = {n: each for n, each in columns.items() if np.any(each[0] != each[1])}
    if not other:
        return TRIALS, "every deviation is the same in both, to the last bit"
    varying = {
        n: each for n, each in columns.items() if all(np.ptp(x) > 0 for x in each)
    }
    if not varying:
        return UNPAIRED, "no part deviates in both"
    otherwise = [n for n, each in varying.items() if not _same_order(*each)]
    strangers = [n for n in otherwise if not _go_together(*varying[n])]
    if len(strangers) == len(varying):
        return UNPAIRED, "one seed, but no part has the same order of deviations"
    words = f"the order of all {common} deviations of a part is the same in both; "
    words += f"widths differ: {_listed(list(other))}"
    if otherwise:
        words += f"; another order, of correlated parts: {_listed(otherwise)}"
    return NUMBERS, words


def _same_order(a: Array, b: Array) -> bool:
    """Tell whether one order sorts both: the same unit samples made them."""
    drops = np.diff(b[np.lexsort((b, a))])
    return bool(drops.min(initial=0.0) >= -ROUNDING * np.ptp(b))


def _go_together(a: Array, b: Array) -> bool:
    """Tell whether ranks are correlated by more than chance."""
    ranks = [np.argsort(np.argsort(each)) for each in (a, b)]
    r = float(np.asarray(np.corrcoef(ranks))[0, 1])
    return abs(r) > CHANCE / math.sqrt(len(a))


def _listed(names: list[str]) -> str:
    more = len(names) - NAMED
    return ", ".join(names[:NAMED]) + (f" and {more} more" if more > 0 else "")
