"""Main causes of the out-of-limit trials of each limit."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from tolstat.answers.report.report_answer import Cause, Causes, PairCause
from tolstat.answers.sampled_trials import Drawn
from tolstat.model.description import kinds_of_part
from tolstat.statistics.estimate import RANDOM_ONLY, Estimate
from tolstat.statistics.sensitivity.out_of_limit import (
    CLEAR,
    Difference,
    differences,
    least_level,
    of_kind,
)
from tolstat.statistics.sensitivity.pairs import BOTH_FAR, SUM, Together, pairs
from tolstat.store.run_records import Halved, Members
from tolstat.store.stored_run import Run

Array = NDArray[np.float64]

NONE, FEW = "no trial out of limit", "too few to tell"


def main_causes(drawn: Drawn) -> dict[str, Causes]:
    """Compare the out-of-limit trials of each limit with the others.

    Parameters
    ----------
    drawn : Drawn
        The trials.

    Returns
    -------
    dict of str to Causes
        By limited response; failed trials count as out of limit.
    """
    run, ran = drawn.run, drawn.sample.ran
    out = {name: run.beyond(name)[drawn.trials][ran] for name in run.limits}
    if drawn.sample.replicates:
        return {
            name: Causes(int(each.sum()), RANDOM_ONLY, (), {}, {})
            for name, each in out.items()
        }
    deviations = _deviating(drawn)
    members = kinds_of_part(list(deviations), run.contributors)
    paired = _paired(run, deviations, out)
    differing = differences(deviations, out)
    return {
        name: _causes(int(each.sum()), differing[name], list(deviations), members,
                        run.diagnostics.halved.get(name, {}), run)._replace(
                            pairs=paired[name])
        for name, each in out.items()
    }  # fmt: skip


def _paired(
    run: Run, deviations: Mapping[str, Array], out: Mapping[str, NDArray[np.bool_]]
) -> dict[str, tuple[PairCause, ...]]:
    """Name the pairs that explain the out-of-limit trials of each limit."""
    found, unknown = {}, _unknown(run)
    for name, together in pairs(deviations, out).items():
        halved = run.diagnostics.halved.get(name, {})
        found[name] = tuple(
            PairCause(_in_words(each), each, *halved.get(each.members, unknown))
            for each in together
        )
    return found


def _deviating(drawn: Drawn) -> dict[str, Array]:
    """Return the contributors that deviate, of the trials that ran."""
    ran = drawn.sample.ran
    columns = {n.name: drawn.values(n.name)[ran] for n in drawn.run.contributors}
    return {n: x for n, x in columns.items() if len(x) and np.ptp(x) > 0}


def _unknown(run: Run) -> Halved:
    missing = run.diagnostics.missing or "not stored in this run"
    return Halved(Estimate(math.nan, reason=missing), 0)


def _in_words(found: Together) -> str:
    """Say what two contributors do in out-of-limit trials."""
    (a, b), way = found.members, found.way
    if found.how == BOTH_FAR:
        return f"{a} and {b} both in the outer 5 %"
    if found.how == SUM:
        sides = {1: "high", -1: "low", 0: "high, or both low"}
        return f"{a} and {b} both {sides[way]}"
    if not way:
        return f"{a} and {b} differ: one high, one low"
    return f"{a} high with {b} low" if way > 0 else f"{b} high with {a} low"


def _causes(
    count: int,
    differing: Mapping[str, Difference],
    names: Sequence[str],
    members: Mapping[str, Sequence[str]],
    halved: Mapping[Members, Halved],
    run: Run,
) -> Causes:
    """Put together what is known of each contributor and each kind of part."""
    unknown = _unknown(run)
    contributors = {}
    for name in names:
        difference = differing.get(name, _NO_DIFFERENCE)
        contributors[name] = Cause(*difference, *halved.get((name,), unknown))
    kinds = {
        kind: Cause(math.nan, math.nan, of_kind(parts, differing),
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
    clear = [name for name, each in told.items() if each.significant]
    leading = sorted(clear, key=lambda name: told[name].level)
    return Causes(count, reason, tuple(leading), contributors, kinds)


_NO_DIFFERENCE = Difference(math.nan, math.nan, 1.0)
