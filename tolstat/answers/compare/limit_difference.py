"""Trials out of limit in two designs: fractions, Ppk, trials that change sides."""

from typing import NamedTuple

from tolstat.answers.compare.pairing import Pairing
from tolstat.statistics.estimate import Estimate, without_interval
from tolstat.statistics.intervals.moments import Reach
from tolstat.statistics.intervals.replicates import mean_of_replicates
from tolstat.statistics.intervals.shares import proportion
from tolstat.statistics.limits.difference import (
    correlation_of_shares,
    difference,
    difference_of_ppk,
    exchange,
)
from tolstat.statistics.limits.limit import within
from tolstat.statistics.summary import by_share


class LimitDifference(NamedTuple):
    """Two designs and their limits; differences are second less first."""

    # the limit of each, or that of the other where it has none
    limits: tuple[str, str]
    # of each, for a single look; failed trials are out of limit
    fractions_out_of_limit: tuple[Estimate, Estimate]
    worse: int | None  # trials within in the first and out of limit in the second
    better: int | None  # the reverse; None of unpaired runs
    fraction_out_of_limit_difference: Estimate
    equivalent_ppks: tuple[Estimate, Estimate]
    equivalent_ppk_difference: Estimate
    moments_ppk_difference: Estimate

    @property
    def significant(self) -> int:
        """1 for significantly more trials out of limit in the second, -1 for fewer."""
        difference = self.fraction_out_of_limit_difference
        return int(difference.lower > 0) - int(difference.upper < 0)


def limit_difference(pair: Pairing, name: str) -> LimitDifference | None:
    """Return the difference in trials out of the limit of a response of both runs.

    Paired runs are compared by the trials that ran in both. None where neither study
    limits the response.
    """
    a, b = (drawn.run.limits.get(name) for drawn in (pair.first, pair.second))
    if (limit := a or b) is None:
        return None
    limits = a or limit, b or limit
    sample = pair.sample
    samples = (sample, sample) if sample else (pair.first.sample, pair.second.sample)
    out = [
        ~(within(values, limit.permitted) & ran.done)
        for values, limit, ran in zip(pair.values(name), limits, samples, strict=True)
    ]
    before, after = (
        ran.share(flags, ran.ran, proportion)
        for flags, ran in zip(out, samples, strict=True)
    )
    ppks = by_share(before, limits[0]), by_share(after, limits[1])
    more, together, worse, better = difference(before, after), 0.0, None, None
    if sample:
        first, second = (~flags[sample.ran] for flags in out)
        worse, better, more = exchange(first, second)
        together = correlation_of_shares(first, second)
        if sample.replicates:
            less, ends = first.astype(float) - second, Reach((-1.0, 1.0))
            more = mean_of_replicates(less, sample.replicate[sample.ran], ends)
    moments = difference_of_ppk(*pair.done(name), limits)
    ppk_more = difference(*ppks, together)
    if any(ran.replicates for ran in samples):
        moments = without_interval(moments)
        ppk_more = without_interval(ppk_more) if sample else ppk_more
    return LimitDifference(
        (limits[0].words, limits[1].words), (before, after), worse, better, more, ppks,
        ppk_more, moments,
    )  # fmt: skip
