"""Two or more runs compared: trial by trial where they are paired."""

import math
from collections.abc import Collection, Mapping, Sequence
from string import ascii_uppercase
from typing import NamedTuple

import numpy as np

from tolstat.answers.compare.comparison import (
    ComparedResponse,
    Comparison,
    Design,
    Difference,
    LimitDifference,
    ResponseDifference,
    SignificantChanges,
    limits_of,
)
from tolstat.answers.compare.pairing import NOT_PAIRED, Pairing, pair_of
from tolstat.answers.report.report_warnings import jumping, warnings_of
from tolstat.answers.report.summaries import described_responses
from tolstat.answers.run_answer import responses_in_focus
from tolstat.answers.sampled_trials import Drawn
from tolstat.arrays import Array, Truths
from tolstat.errors import QuestionError
from tolstat.statistics.estimate import RANDOM_ONLY, Estimate, without_interval
from tolstat.statistics.intervals.moments import Reach
from tolstat.statistics.intervals.replicates import mean_of_replicates
from tolstat.statistics.intervals.shares import anytime_valid, proportion
from tolstat.statistics.limits.difference import (
    correlation_of_quantiles,
    correlation_of_shares,
    difference,
    difference_of_ppk,
    exchange,
)
from tolstat.statistics.limits.limit import Limit, within
from tolstat.statistics.sample import Sample, quantiles_at
from tolstat.statistics.summary import Summary, by_share, summarize
from tolstat.store.open_run import RunSource
from tolstat.store.open_run import open as open_run
from tolstat.store.run_records import Plan, differences
from tolstat.store.stored_run import Run

LABELS = ascii_uppercase
COMPARED = (0.5, 0.95)  # quantiles of which there is a difference


def compare(*runs: RunSource, responses: Sequence[str] = ()) -> Comparison:
    """Return a comparison of runs with the first of them.

    Trial by trial where both runs have the same trials, or common random numbers; see
    `tolstat.answers.compare.pairing.pair_of`.

    Parameters
    ----------
    *runs : Run or path
        Two or more.
    responses : sequence of str
        Responses in focus; those with a limit if none are given.

    Raises
    ------
    QuestionError
        If fewer than two runs are given, trials were not sampled, or no response is in
        both.
    RunFileError
        If a run cannot be read.

    Examples
    --------
    >>> other = tolstat.run("runs/stack-up.toml", seed=2, output="other.h5")
    >>> tolstat.compare("runs/stack-up.h5", other)
    <tolstat compare: A stack-up.h5, B other.h5; B unpaired>
    """
    if not 2 <= len(runs) <= len(LABELS):
        raise QuestionError(
            f"two runs or more are compared, up to {len(LABELS)}; given: {len(runs)}"
        )
    first, *rest = map(open_run, runs)
    pairs = [pair_of(first, run) for run in rest]
    common = {name for pair in pairs for name in pair.responses}
    names = [response.name for response in first.responses if response.name in common]
    A = _design("A", pairs[0].first, names)
    others = [
        _design(label, pair.second, pair.responses)
        for label, pair in zip(LABELS[1:], pairs, strict=False)
    ]
    return Comparison(
        {n: ComparedResponse(x.sentence, x.scale) for n, x in A.responses.items()},
        (A, *others),
        tuple(
            _difference(pair, A, design, responses)
            for pair, design in zip(pairs, others, strict=True)
        ),
    )


def _design(label: str, drawn: Drawn, names: Sequence[str]) -> Design:
    run, summaries = drawn.run, described_responses(drawn)
    clusters = jumping(run, drawn.trials_done, dict.fromkeys([*run.limits, *names]))
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
        warnings_of(drawn, clusters),
        {name: summaries[name] for name in names},
    )


def _difference(
    pair: Pairing, first: Design, second: Design, chosen: Sequence[str]
) -> Difference:
    a, b = pair.first.run, pair.second.run
    common = a.settings.keys() & b.settings.keys()
    focus = [*responses_in_focus(a, chosen), *responses_in_focus(b, chosen)]
    responses = differences_of(pair, first.responses, second.responses)
    tails = {n: (first.responses[n], second.responses[n]) for n in responses}
    normal = [n for n, both in tails.items() if all(x.normal_tails for x in both)]
    return Difference(
        second.label,
        pair,
        {n: x for n, x in _that_differ(a, b, "setting").items() if n in common},
        _that_differ(a, b, "deviation"),
        focus=tuple(name for name in dict.fromkeys(focus) if name in pair.responses),
        responses=responses,
        findings=_significant(limits_of(responses), normal),
    )


def differences_of(
    pair: Pairing, before: Mapping[str, Summary], after: Mapping[str, Summary]
) -> dict[str, ResponseDifference]:
    """Return the differences of all responses of both runs, second less first."""
    return {n: _response(pair, n, before[n], after[n]) for n in pair.responses}


def _significant(
    limits: Mapping[str, LimitDifference], normal: Collection[str]
) -> SignificantChanges:
    """Return what differs; responses that are `normal` have a Ppk by moments."""
    fewer, more, neither = (
        tuple(name for name, limit in limits.items() if limit.significant == sign)
        for sign in (-1, 1, 0)
    )
    comparable = [name for name in neither if name in normal]
    higher, lower = (
        tuple(name for name in comparable if limits[name].significant_ppk == sign)
        for sign in (1, -1)
    )
    return SignificantChanges(fewer, more, neither, higher, lower)


def _that_differ(first: Plan, second: Plan, kind: str) -> dict[str, tuple[str, str]]:
    """Return the entries that differ between two plans."""
    both = differences(first.entries[kind], second.entries[kind])
    return {name: (a or "", b or "") for name, a, b in both}


def _response(
    pair: Pairing, name: str, before: Summary, after: Summary
) -> ResponseDifference:
    limit, sample = _limit_difference(pair, name), pair.sample
    if sample is None:
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
    of_trials = summarize(less, sample, declared=declared)
    return ResponseDifference(
        of_trials,
        sample.share(less < 0, sample.done, proportion),
        sample.share(less > 0, sample.done, proportion),
        of_trials.mean,
        _of_quantiles(pair, name, sample),
        limit,
    )


def _of_quantiles(pair: Pairing, name: str, sample: Sample) -> dict[float, Estimate]:
    """Return the differences of quantiles, second less first, of paired trials."""
    both, estimates = pair.values(name), []
    for drawn, values in zip((pair.first, pair.second), both, strict=True):
        limit = drawn.run.limits.get(name)
        ends = limit.permitted if limit else None
        estimates.append(quantiles_at(values, sample, COMPARED, ends))
    differences = {}
    for share in COMPARED:
        a, b = estimates[0][share], estimates[1][share]
        if sample.replicates:
            differences[share] = Estimate(b.value - a.value, reason=RANDOM_ONLY)
        else:
            correlation = correlation_of_quantiles(*both, (a, b))
            differences[share] = difference(a, b, correlation)
    return differences


def _limit_difference(pair: Pairing, name: str) -> LimitDifference | None:
    """Return the difference in trials out of the limit of a response of both runs.

    The fractions are those of all trials that a report judges. None where neither study
    limits the response.
    """
    both = pair.first, pair.second
    a, b = (design.run.limits.get(name) for design in both)
    if (limit := a or b) is None:
        return None
    limits = a or limit, b or limit
    judged = [_judged(*side, name) for side in zip(both, limits, strict=True)]
    before, after = (side.fraction for side in judged)
    ran, sample = (judged[0].ran, judged[1].ran), pair.sample
    more, together, worse, better = difference(before, after), 0.0, None, None
    thinned = any(design.run.thinned for design in both)
    if sample and not thinned:  # thinned ones are not paired: chance evaluates others
        first, second = (~side.out[: pair.trials][sample.ran] for side in judged)
        worse, better, exact = exchange(first, second)
        common = len(first)
        if not sample.replicates:
            together = correlation_of_shares(first, second)
            together *= common / math.sqrt(math.prod(ran))
        if ran != (common, common) or any(design.run.stopped for design in both):
            more = difference(before, after, together)
        elif sample.replicates:
            less, ends = first.astype(float) - second, Reach((-1.0, 1.0))
            more = mean_of_replicates(less, sample.replicate[sample.ran], ends)
        else:
            more = exact
    ppks = by_share(before, limits[0]), by_share(after, limits[1])
    moments = Estimate(math.nan, reason=RANDOM_ONLY)
    samples = [design.sample for design in both]
    if not any(x.weights for x in samples):
        moments = difference_of_ppk(*pair.done(name), limits)
    ppk_more = difference(*ppks, together)
    if any(x.replicates for x in samples):
        moments = without_interval(moments)
        ppk_more = without_interval(ppk_more) if sample else ppk_more
    same_limit = limits[0].permitted == limits[1].permitted
    if sample and thinned and same_limit and _are_equal(*pair.values(name)):
        more, ppk_more = (_of_equal_trials(x) for x in (more, ppk_more))
    return LimitDifference(
        (limits[0].words, limits[1].words), (before, after), ran, worse, better, more,
        ppks, ppk_more, moments,
    )  # fmt: skip


def _are_equal(first: Array, second: Array) -> bool:
    return np.array_equal(first, second, equal_nan=True)


def _of_equal_trials(less: Estimate) -> Estimate:
    """Return a difference that chance alone makes, by which trials it evaluates: 0."""
    is_outside = less.lower > 0 or less.upper < 0
    return less if is_outside else less._replace(value=0.0)


class _Judged(NamedTuple):
    out: Truths  # of limit, by trial; failed ones are
    ran: int
    fraction: Estimate  # as uncertain as few measured parts make it


def _judged(design: Drawn, limit: Limit, name: str) -> _Judged:
    """Return what a report judges a limit by.

    Where another design has the limit, by the stages that left out no trials. For any
    number of trials if the run chose it by its results, else for a single look.
    """
    has_limit = name in design.run.limits
    judged = design.judged(1 - limit.demanded if has_limit else 1.0)
    sample = judged.sample_for(name)
    out = ~(within(judged.values(name), limit.permitted) & sample.done)
    counted = anytime_valid if design.run.stopped else proportion
    share = sample.share(out, sample.ran, counted)
    if uncertainty := design.uncertainty(name):
        share = uncertainty.widened(share)
    return _Judged(out, int(np.count_nonzero(sample.ran)), share)


def _range_of_difference(
    first: Run, second: Run, name: str
) -> tuple[float, float] | None:
    """Return the range of the difference; None unless both runs declare a range."""
    a, b = ({r.name: r.range for r in run.responses}[name] for run in (first, second))
    return None if a is None or b is None else (b[0] - a[1], b[1] - a[0])
