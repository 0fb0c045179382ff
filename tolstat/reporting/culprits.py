"""Who drives the machines beyond each limit."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from tolstat.reporting.drawn import Drawn
from tolstat.reporting.findings import Culprit, Culprits
from tolstat.statistics.beyond import (
    CLEAR,
    Difference,
    differences,
    least_level,
    of_kind,
)
from tolstat.statistics.estimate import RANDOM_ONLY, Estimate
from tolstat.store.evidence import Halved, Members
from tolstat.store.run import Run

NONE, FEW = "none beyond", "too few beyond to tell"


def culprits_of(
    drawn: Drawn, members: Mapping[str, tuple[str, ...]]
) -> dict[str, Culprits]:
    """Compare the machines beyond each limit with the others.

    Parameters
    ----------
    drawn : Drawn
        The trials.
    members : mapping of str to tuple of str
        The contributors of each kind of part.

    Returns
    -------
    dict of str to Culprits
        By limited response; failed trials count as beyond.
    """
    run, ran = drawn.run, drawn.sample.ran
    beyond = {name: run.beyond(name)[drawn.trials][ran] for name in run.limits}
    if drawn.sample.replicates:
        return {
            name: Culprits(int(each.sum()), RANDOM_ONLY, (), {}, {})
            for name, each in beyond.items()
        }
    columns = {each.name: drawn.values(each.name)[ran] for each in run.contributors}
    deviations = {n: x for n, x in columns.items() if len(x) and np.ptp(x) > 0}
    differing = differences(deviations, beyond)
    return {
        name: _culprits(int(each.sum()), differing[name], list(deviations), members,
                        run.evidence.halved.get(name, {}), run)
        for name, each in beyond.items()
    }  # fmt: skip


def _culprits(
    count: int,
    differing: Mapping[str, Difference],
    names: Sequence[str],
    members: Mapping[str, tuple[str, ...]],
    halved: Mapping[Members, Halved],
    run: Run,
) -> Culprits:
    """Put together what is known of each contributor and each kind of part."""
    missing = run.evidence.missing or "not stored in this run"
    unknown = Halved(Estimate(math.nan, reason=missing), 0)
    contributors = {}
    for name in names:
        difference = differing.get(name, _NO_DIFFERENCE)
        contributors[name] = Culprit(*difference, *halved.get((name,), unknown))
    kinds = {
        kind: Culprit(math.nan, math.nan, of_kind(parts, differing),
                      *halved.get(tuple(parts), unknown))
        for kind, parts in members.items()
    }  # fmt: skip
    reason = ""
    if count == 0:
        reason = NONE
    elif least_level(count, len(names)) >= CLEAR:
        reason = FEW
    grouped = {part for parts in members.values() for part in parts}
    told = {n: each for n, each in contributors.items() if n not in grouped} | kinds
    clear = [name for name, each in told.items() if each.clear]
    driving = sorted(clear, key=lambda name: told[name].level)
    return Culprits(count, reason, tuple(driving), contributors, kinds)


_NO_DIFFERENCE = Difference(math.nan, math.nan, 1.0)
