"""Machines within and beyond a limit in two designs: shares, Ppk, who changes sides."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.answers.compare.pairing import Pair
from tolstat.statistics.estimate import RANDOM_ONLY, Estimate
from tolstat.statistics.intervals.moments import Reach
from tolstat.statistics.intervals.proportions import proportion
from tolstat.statistics.intervals.replicates import (
    mean_of_replicates,
    share_from_replicates,
)
from tolstat.statistics.limits.capability import by_share
from tolstat.statistics.limits.difference import (
    Exchange,
    correlation_of_shares,
    difference,
    difference_of_ppk,
    exchange,
)
from tolstat.statistics.limits.limit import within
from tolstat.statistics.sample import Sample

Machines = NDArray[np.bool_]


class YieldsCompared(NamedTuple):
    """What a limit makes of two designs; differences are second less first.

    Attributes
    ----------
    limits : tuple of str
        By which each is judged: its own, or that of the other where it has none.
    beyond : tuple of Estimate
        Share beyond in each, failed machines among them.
    worse, better : int or None
        Machines that are within in the first and beyond in the second, and the other
        way round; None of unpaired runs.
    beyond_more : Estimate
        Share beyond in the second less that in the first.
    ppk : tuple of Estimate
        Of a normal response with as many beyond, in each.
    ppk_more : Estimate
        Their difference.
    ppk_more_by_moments : Estimate
        Difference of Ppk from mean and sigma.
    """

    limits: tuple[str, str]
    beyond: tuple[Estimate, Estimate]
    worse: int | None
    better: int | None
    beyond_more: Estimate
    ppk: tuple[Estimate, Estimate]
    ppk_more: Estimate
    ppk_more_by_moments: Estimate


def yields_of(pair: Pair, name: str) -> YieldsCompared | None:
    """Compare the machines within and beyond the limit of a response.

    Parameters
    ----------
    pair : Pair
        Two runs.
    name : str
        Of a response that both have.

    Returns
    -------
    YieldsCompared or None
        Of the machines that are compared: those that ran in both where they are
        paired. None where neither study limits the response.
    """
    own = [drawn.run.limits.get(name) for drawn in (pair.first, pair.second)]
    known = [limit for limit in own if limit is not None]
    if not known:
        return None
    limits = own[0] or known[0], own[1] or known[0]
    samples = (pair.sample or pair.first.sample, pair.sample or pair.second.sample)
    good = [
        (within(values, limit.permitted) & sample.done)[sample.ran]
        for values, limit, sample in zip(
            pair.values(name), limits, samples, strict=True
        )
    ]
    a, b = (_share(~each, of) for each, of in zip(good, samples, strict=True))
    ppks = by_share(a, limits[0]), by_share(b, limits[1])
    changes, more, together = None, difference(a, b), 0.0
    moments = difference_of_ppk(*pair.done(name), limits)
    replicated = samples[0].replicates or samples[1].replicates
    if pair.sample is not None:
        changes = _exchange(good[0], good[1], pair.sample)
        more, together = changes.out_of_limit, correlation_of_shares(good[0], good[1])
    ppk_more = difference(ppks[0], ppks[1], together)
    if replicated:
        moments = _unsure(moments)
        ppk_more = _unsure(ppk_more) if pair.sample else ppk_more
    return YieldsCompared(
        (limits[0].words, limits[1].words),
        (a, b),
        changes.worse if changes else None,
        changes.better if changes else None,
        more,
        ppks,
        ppk_more,
        moments,
    )


def _share(machines: Machines, sample: Sample) -> Estimate:
    """Estimate a share of the trials that ran, at one look."""
    if sample.replicates:
        return share_from_replicates(machines, sample.replicate[sample.ran])
    return proportion(int(machines.sum()), len(machines))


def _exchange(first: Machines, second: Machines, sample: Sample) -> Exchange:
    """Count who changes sides among trials, which may depend on each other."""
    found = exchange(first, second)
    if not sample.replicates:
        return found
    more = first.astype(np.float64) - second
    share = Reach((-1.0, 1.0))
    beyond = mean_of_replicates(more, sample.replicate[sample.ran], share)
    return found._replace(out_of_limit=beyond)


def _unsure(found: Estimate) -> Estimate:
    """Leave out an interval that dependent trials would mislead."""
    return Estimate(found.value, reason=RANDOM_ONLY) if found.sure else found
