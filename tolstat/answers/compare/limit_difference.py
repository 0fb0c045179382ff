"""Trials out of limit in two designs: fractions, Ppk, trials that change sides."""

from typing import NamedTuple

from tolstat.answers.compare.pairing import Pairing
from tolstat.statistics.estimate import Estimate, without_interval
from tolstat.statistics.intervals.moments import Reach
from tolstat.statistics.intervals.replicates import mean_of_replicates
from tolstat.statistics.intervals.shares import proportion
from tolstat.statistics.limits.capability import by_share
from tolstat.statistics.limits.difference import (
    correlation_of_shares,
    difference,
    difference_of_ppk,
    exchange,
)
from tolstat.statistics.limits.limit import within


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
        found = self.fraction_out_of_limit_difference
        return int(found.lower > 0) - int(found.upper < 0)


def limit_difference(pair: Pairing, name: str) -> LimitDifference | None:
    """Return the difference in trials out of the limit of a response of both runs.

    Paired runs are compared by the trials that ran in both. None where neither study
    limits the response.
    """
    own = [drawn.run.limits.get(name) for drawn in (pair.first, pair.second)]
    known = [limit for limit in own if limit is not None]
    if not known:
        return None
    limits = own[0] or known[0], own[1] or known[0]
    sample = pair.sample
    samples = (sample, sample) if sample else (pair.first.sample, pair.second.sample)
    out = [
        ~(within(values, limit.permitted) & of.done)
        for values, limit, of in zip(pair.values(name), limits, samples, strict=True)
    ]
    a, b = (
        of.share(flags, of.ran, proportion)
        for flags, of in zip(out, samples, strict=True)
    )
    ppks = by_share(a, limits[0]), by_share(b, limits[1])
    more, together, worse, better = difference(a, b), 0.0, None, None
    if sample:
        first, second = (~flags[sample.ran] for flags in out)
        worse, better, more = exchange(first, second)
        together = correlation_of_shares(first, second)
        if sample.replicates:
            less, ends = first.astype(float) - second, Reach((-1.0, 1.0))
            more = mean_of_replicates(less, sample.replicate[sample.ran], ends)
    moments = difference_of_ppk(*pair.done(name), limits)
    ppk_more = difference(*ppks, together)
    if any(of.replicates for of in samples):
        moments = without_interval(moments)
        ppk_more = without_interval(ppk_more) if sample else ppk_more
    return LimitDifference(
        (limits[0].words, limits[1].words), (a, b), worse, better, more, ppks,
        ppk_more, moments,
    )  # fmt: skip
