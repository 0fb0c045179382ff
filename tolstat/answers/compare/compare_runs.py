"""Two or more runs compared: trial by trial where they are paired."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from string import ascii_uppercase

import numpy as np

from tolstat.answers.compare.comparison import (
    COMPARED,
    ComparedResponse,
    Comparison,
    Design,
    DesignResponse,
    Difference,
    Pairing,
    ResponseDifference,
)
from tolstat.answers.compare.limit_difference import limit_difference
from tolstat.answers.compare.pairing import UNPAIRED, Pair, pair_of
from tolstat.answers.report.gather import summaries_of
from tolstat.answers.run_answer import responses_in_focus
from tolstat.answers.sampled_trials import Drawn
from tolstat.errors import PictureError
from tolstat.statistics.estimate import RANDOM_ONLY, Estimate
from tolstat.statistics.intervals.shares import proportion
from tolstat.statistics.intervals.statistic import quantiles_at
from tolstat.statistics.limits.difference import correlation_of_quantiles, difference
from tolstat.statistics.sample import Sample
from tolstat.statistics.summary import Summary, summarize
from tolstat.store.open_run import open as open_run
from tolstat.store.stored_run import Run

LABELS = ascii_uppercase
NOT_PAIRED = Estimate(math.nan, reason=UNPAIRED)


def compare(
    first: Run | str | os.PathLike[str],
    second: Run | str | os.PathLike[str],
    *others: Run | str | os.PathLike[str],
    responses: Sequence[str] = (),
) -> Comparison:
    """Compare runs with the first of them.

    Trial by trial where both runs have the same trials, or common random numbers; see
    `tolstat.answers.compare.pairing.pair_of`.

    Parameters
    ----------
    responses : sequence of str
        Responses in focus; those with a limit if none are given.

    Raises
    ------
    PictureError
        If trials were not sampled, or no response is in both.
    RunFileError
        If a run cannot be read.
    """
    if len(others) + 2 > len(LABELS):
        raise PictureError(f"{len(others) + 2} runs; allowed: up to {len(LABELS)}")
    runs = [
        each if isinstance(each, Run) else open_run(each) for each in (second, *others)
    ]
    first = first if isinstance(first, Run) else open_run(first)
    pairs = tuple(pair_of(first, run) for run in runs)
    names = [
        each.name
        for each in first.responses
        if any(each.name in pair.responses for pair in pairs)
    ]
    designs = [_design("A", pairs[0].first, names)]
    for label, pair in zip(LABELS[1:], pairs, strict=False):
        designs.append(_design(label, pair.second, pair.responses))
    known = {each.name: each for each in first.responses}
    return Comparison(
        {n: ComparedResponse(known[n].sentence, first.scales[n]) for n in names},
        tuple(designs),
        tuple(
            _difference(pair, designs[0], design, responses)
            for pair, design in zip(pairs, designs[1:], strict=True)
        ),
        pairs,
    )


def _design(label: str, drawn: Drawn, names: Sequence[str]) -> Design:
    run, summaries = drawn.run, summaries_of(drawn)
    return Design(
        label,
        run.title,
        run.path.name,
        run.model,
        int(np.count_nonzero(drawn.sample.done)),
        drawn.sample.failed,
        run.provenance["started_at"],
        run.source_digest,
        run.provenance["version_tolstat"],
        {
            name: DesignResponse(
                **vars(summaries[name]), nominal=run.nominal_values[name]
            )
            for name in names
        },
    )


def _difference(
    pair: Pair, first: Design, second: Design, chosen: Sequence[str]
) -> Difference:
    runs = pair.first.run, pair.second.run
    shared = runs[0].settings.keys() & runs[1].settings.keys()
    settings = [
        {n: each.words for n, each in run.settings.items() if n in shared}
        for run in runs
    ]
    focus = [name for run in runs for name in responses_in_focus(run, chosen)]
    return Difference(
        second.label,
        _pairing(pair),
        _that_differ(*settings),
        _that_differ(*({n: d.words for n, d in run.assumed.items()} for run in runs)),
        tuple(name for name in dict.fromkeys(focus) if name in pair.responses),
        {
            name: _response(pair, name, first.responses[name], second.responses[name])
            for name in pair.responses
        },
    )


def _that_differ(
    first: Mapping[str, str], second: Mapping[str, str]
) -> dict[str, tuple[str, str]]:
    """Return what two studies say otherwise."""
    pairs = {n: (first.get(n, ""), second.get(n, "")) for n in {**first, **second}}
    return {name: (a, b) for name, (a, b) in pairs.items() if a != b}


def _pairing(pair: Pair) -> Pairing:
    sample, promise = pair.sample, _promise(pair.first)
    if sample is None:
        return Pairing(pair.kind, pair.words, 0, 0, 0, NOT_PAIRED, promise)
    done = int(np.count_nonzero(sample.done))
    return Pairing(
        pair.kind, pair.words, len(sample.done), done, sample.failed, sample.failures,
        promise,
    )  # fmt: skip


def _promise(drawn: Drawn) -> str:
    """Say what intervals hold for; those of verdicts, at every look, are not shown."""
    of_quantiles = drawn.sampled.promise
    if drawn.run.sampling == "random":
        of_quantiles = "of quantiles exact, as random trials are independent"
    return f"{of_quantiles}; of fractions and Ppk for a single look"


def _response(
    pair: Pair, name: str, before: Summary, after: Summary
) -> ResponseDifference:
    limit = limit_difference(pair, name)
    if pair.sample is None:
        return ResponseDifference(
            None,
            NOT_PAIRED,
            NOT_PAIRED,
            difference(before.mean, after.mean),
            {q: difference(before.quantiles[q], after.quantiles[q]) for q in COMPARED},
            limit,
        )
    first, second = pair.values(name)
    less = second - first
    declared = _range_of_difference(pair.first.run, pair.second.run, name)
    of_trials = summarize(less, pair.sample, declared=declared)
    return ResponseDifference(
        of_trials,
        pair.sample.share(less < 0, pair.sample.done, proportion),
        pair.sample.share(less > 0, pair.sample.done, proportion),
        of_trials.mean,
        _of_quantiles(pair, name, pair.sample),
        limit,
    )


def _of_quantiles(pair: Pair, name: str, sample: Sample) -> dict[float, Estimate]:
    """Take the quantiles of the first from those of the second, of paired trials."""
    first, second = pair.values(name)
    ends = [run.limits.get(name) for run in (pair.first.run, pair.second.run)]
    known = [
        quantiles_at(values, sample, COMPARED, limit.permitted if limit else None)
        for values, limit in zip((first, second), ends, strict=True)
    ]
    found = {}
    for share, a, b in ((q, known[0][q], known[1][q]) for q in COMPARED):
        if sample.replicates:
            found[share] = Estimate(b.value - a.value, reason=RANDOM_ONLY)
            continue
        found[share] = difference(a, b, correlation_of_quantiles(first, second, (a, b)))
    return found


def _range_of_difference(
    first: Run, second: Run, name: str
) -> tuple[float, float] | None:
    """Return what the difference cannot leave, where both runs declare their range."""
    a, b = ({r.name: r.range for r in run.responses}[name] for run in (first, second))
    return None if a is None or b is None else (b[0] - a[1], b[1] - a[0])
