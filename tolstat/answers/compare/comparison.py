"""Two designs compared: what differs, machine by machine where they are paired."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.answers.compare.pairing import UNPAIRED, Pair, pair_of
from tolstat.answers.compare.yields_compared import YieldsCompared, yields_of
from tolstat.answers.report.gather import responses_of_interest
from tolstat.answers.report.summary_table import summaries_of
from tolstat.answers.sampled_trials import Drawn
from tolstat.statistics.estimate import RANDOM_ONLY, Estimate
from tolstat.statistics.intervals.proportions import proportion
from tolstat.statistics.intervals.replicates import share_from_replicates
from tolstat.statistics.intervals.statistic import quantiles_at
from tolstat.statistics.limits.difference import correlation_of_quantiles, difference
from tolstat.statistics.sample import Sample
from tolstat.statistics.summary import Summary, summarize
from tolstat.store.stored_run import Run
from tolstat.units.scale import Scale

AT_ONE_LOOK = "shares and Ppk at one look"
COMPARED = (0.5, 0.95)  # quantiles of which the difference is told
NOT_PAIRED = Estimate(math.nan, reason=UNPAIRED)


class SideFindings(NamedTuple):
    """One of the two runs: what it is, and how it came to be."""

    title: str
    run: str
    model: str
    done: int
    failed: int
    started_at: str
    source_digest: str
    version_tolstat: str


class PairFindings(NamedTuple):
    """The machines of both.

    Attributes
    ----------
    asked, done_in_both, failed : int
        Machines that are in both runs, done in both, and failed in one or both; 0 of
        unpaired runs.
    failures : Estimate
        Share that failed.
    promise : str
        What their sampling allows to say at the one look that a comparison is.
    kind, words : str
        "same machines", "same qualities" or "unpaired", and how that is known.
    """

    asked: int
    done_in_both: int
    failed: int
    failures: Estimate
    promise: str
    kind: str
    words: str


class Shift(NamedTuple):
    """By how much the numbers of a response differ: second less first.

    Attributes
    ----------
    mean : Estimate
        Of means.
    quantiles : dict of float to Estimate
        Of medians, and of the values that 95 % of the machines stay below.
    """

    mean: Estimate
    quantiles: Mapping[float, Estimate]


@dataclass(frozen=True)
class Sided(Summary):
    """A response in one of the designs, with that of its nominal machine."""

    nominal: float


@dataclass(frozen=True)
class ResponseCompared:
    """A response in both designs.

    Attributes
    ----------
    sentence : str
        What it is.
    scale : Scale
        How it is shown: as the first study has it.
    first, second : Sided
        In each design.
    difference : Summary or None
        Second less first, machine by machine; None of unpaired runs.
    smaller, larger : Estimate
        Share of the machines in which the second is smaller, or larger.
    shift : Shift
        By how much numbers of the second differ from those of the first.
    yields : YieldsCompared or None
        Machines within and beyond; None where neither study has a limit.
    """

    sentence: str
    scale: Scale
    first: Sided
    second: Sided
    difference: Summary | None
    smaller: Estimate
    larger: Estimate
    shift: Shift
    yields: YieldsCompared | None


@dataclass(frozen=True)
class Comparison:
    """What a comparison says; SI, differences are second less first.

    Attributes
    ----------
    first, second : SideFindings
        The runs.
    settings, deviations : dict of str to tuple of str
        Those that differ, as they are written; empty in a run that has no such one.
    trials : PairFindings
        The machines of both.
    interest : tuple of str
        Responses that are looked at closely.
    responses : dict of str to ResponseCompared
        All that both have.
    """

    first: SideFindings
    second: SideFindings
    settings: Mapping[str, tuple[str, str]]
    deviations: Mapping[str, tuple[str, str]]
    trials: PairFindings
    interest: tuple[str, ...]
    responses: Mapping[str, ResponseCompared]


@dataclass(frozen=True)
class Comparisons:
    """Several runs, each compared with the first.

    Attributes
    ----------
    comparisons : tuple of Comparison
        In the order of the runs.
    """

    comparisons: tuple[Comparison, ...]

    @property
    def alone(self) -> Comparison | None:
        """The only one; None of three runs or more."""
        return self.comparisons[0] if len(self.comparisons) == 1 else None


def compared_with_first(
    runs: Sequence[Run], chosen: Sequence[str] = ()
) -> tuple[list[Pair], Comparisons]:
    """Compare runs, each with the first of them.

    Parameters
    ----------
    runs : sequence of Run
        Two or more.
    chosen : sequence of str
        Responses to be looked at closely; what has a limit if none are given.
    """
    pairs = [pair_of(runs[0], other) for other in runs[1:]]
    return pairs, Comparisons(tuple(compared(pair, chosen) for pair in pairs))


def compared(pair: Pair, chosen: Sequence[str] = ()) -> Comparison:
    """Gather what a comparison says.

    Parameters
    ----------
    pair : Pair
        Two runs.
    chosen : sequence of str
        Responses to be looked at closely; what has a limit if none are given.
    """
    runs = first, second = pair.first.run, pair.second.run
    shared = first.settings.keys() & second.settings.keys()
    settings = [
        {n: each.words for n, each in run.settings.items() if n in shared}
        for run in runs
    ]
    wanted = [name for run in runs for name in responses_of_interest(run, chosen)]
    summaries = [summaries_of(pair.first), summaries_of(pair.second)]
    responses = {}
    for response in first.responses:
        name = response.name
        if name not in pair.responses:
            continue
        before, after = (
            Sided(**vars(of[name]), nominal=run.nominal_values[name])
            for of, run in zip(summaries, runs, strict=True)
        )
        differences, smaller, larger = _machine_by_machine(pair, name)
        responses[name] = ResponseCompared(
            response.sentence,
            first.scales[name],
            before,
            after,
            differences,
            smaller,
            larger,
            _shift(pair, name, before, after, differences),
            yields_of(pair, name),
        )
    return Comparison(
        _side(pair.first),
        _side(pair.second),
        _that_differ(*settings),
        _that_differ(*({n: d.words for n, d in run.assumed.items()} for run in runs)),
        _trials(pair),
        tuple(name for name in dict.fromkeys(wanted) if name in pair.responses),
        responses,
    )


def _that_differ(
    first: Mapping[str, str], second: Mapping[str, str]
) -> dict[str, tuple[str, str]]:
    """Return what two studies say otherwise."""
    pairs = {n: (first.get(n, ""), second.get(n, "")) for n in {**first, **second}}
    return {name: (a, b) for name, (a, b) in pairs.items() if a != b}


def _trials(pair: Pair) -> PairFindings:
    sample, promise = pair.sample, _promise(pair.first)
    if sample is None:
        return PairFindings(0, 0, 0, NOT_PAIRED, promise, pair.kind, pair.words)
    done = int(np.count_nonzero(sample.done))
    return PairFindings(
        len(sample.done), done, sample.failed, sample.failures, promise, pair.kind,
        pair.words,
    )  # fmt: skip


def _promise(drawn: Drawn) -> str:
    """Say what intervals hold; those of verdicts, that hold at every look, are none."""
    if drawn.run.sampling == "random":
        return f"exact of quantiles, for random trials are independent; {AT_ONE_LOOK}"
    return f"{drawn.sampled.promise}; {AT_ONE_LOOK}"


def _machine_by_machine(
    pair: Pair, name: str
) -> tuple[Summary | None, Estimate, Estimate]:
    """Summarize the differences, and the shares of smaller and larger ones."""
    if pair.sample is None:
        return None, NOT_PAIRED, NOT_PAIRED
    first, second = pair.values(name)
    differences = second - first
    declared = _range_of_difference(pair.first.run, pair.second.run, name)
    return (
        summarize(differences, pair.sample, declared=declared),
        _share(differences < 0, pair.sample),
        _share(differences > 0, pair.sample),
    )


def _shift(
    pair: Pair, name: str, before: Summary, after: Summary, differences: Summary | None
) -> Shift:
    """Take the numbers of the first from those of the second."""
    if pair.sample is None or differences is None:
        return Shift(
            difference(before.mean, after.mean),
            {q: difference(before.quantiles[q], after.quantiles[q]) for q in COMPARED},
        )
    first, second = pair.values(name)
    ends = [run.limits.get(name) for run in (pair.first.run, pair.second.run)]
    known = [
        quantiles_at(values, pair.sample, COMPARED, limit.permitted if limit else None)
        for values, limit in zip((first, second), ends, strict=True)
    ]
    found = {}
    for share, a, b in ((q, known[0][q], known[1][q]) for q in COMPARED):
        if pair.sample.replicates:
            found[share] = Estimate(b.value - a.value, reason=RANDOM_ONLY)
            continue
        found[share] = difference(a, b, correlation_of_quantiles(first, second, (a, b)))
    return Shift(differences.mean, found)


def _range_of_difference(
    first: Run, second: Run, name: str
) -> tuple[float, float] | None:
    """Return what the difference cannot leave, where both runs declare their range."""
    a, b = ({r.name: r.range for r in run.responses}[name] for run in (first, second))
    return None if a is None or b is None else (b[0] - a[1], b[1] - a[0])


def _share(machines: NDArray[np.bool_], sample: Sample) -> Estimate:
    """Estimate a share of the machines that are done in both."""
    done = sample.done
    if sample.replicates:
        return share_from_replicates(machines[done], sample.replicate[done])
    return proportion(int(machines[done].sum()), int(done.sum()))


def _side(drawn: Drawn) -> SideFindings:
    run = drawn.run
    return SideFindings(
        run.title,
        run.path.name,
        run.model,
        int(np.count_nonzero(drawn.sample.done)),
        drawn.sample.failed,
        run.provenance["started_at"],
        run.source_digest,
        run.provenance["version_tolstat"],
    )
