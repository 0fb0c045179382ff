"""Main causes of the out-of-limit trials of each limit."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from tolstat.answers.report.report_answer import Cause, Causes, PairCause
from tolstat.answers.sampled_trials import Drawn
from tolstat.model.description import kinds_of_part
from tolstat.statistics.estimate import RANDOM_ONLY, Estimate
from tolstat.statistics.sensitivity import out_of_limit
from tolstat.statistics.sensitivity.pairs import BOTH_FAR, SUM, Together, pairs
from tolstat.store.run_records import Halved
from tolstat.store.stored_run import Run

NONE, FEW = "no trial out of limit", "too few to tell"
_NO_DIFFERENCE = out_of_limit.Difference(math.nan, math.nan, 1.0)


def main_causes(drawn: Drawn) -> dict[str, Causes]:
    """Return the causes of out-of-limit trials, failed ones too, for each limit.

    By limited response.
    """
    run, ran = drawn.run, drawn.sample.ran
    out = {name: run.beyond(name)[drawn.trials][ran] for name in run.limits}
    if drawn.sample.replicates:
        return {
            name: Causes(int(each.sum()), RANDOM_ONLY, (), {}, {})
            for name, each in out.items()
        }
    deviations = drawn.deviating(ran)
    none = dict.fromkeys(deviations, _NO_DIFFERENCE)
    differing = out_of_limit.differences(deviations, out)
    together = pairs(deviations, out)
    return {
        name: _causes(
            run, name, int(each.sum()), none | differing[name], together[name]
        )
        for name, each in out.items()
    }


def _in_words(found: Together) -> str:
    """Return in words how two contributors lie in out-of-limit trials."""
    (a, b), way = found.members, found.way
    if found.how == BOTH_FAR:
        return f"{a} and {b} both far from their middle"
    if found.how == SUM:
        sides = {1: "high", -1: "low", 0: "high, or both low"}
        return f"{a} and {b} both {sides[way]}"
    if not way:
        return f"{a} and {b} differ: one high, one low"
    return f"{a} high with {b} low" if way > 0 else f"{b} high with {a} low"


def _causes(
    run: Run,
    response: str,
    count: int,
    differing: Mapping[str, out_of_limit.Difference],
    together: Sequence[Together],
) -> Causes:
    """Return the causes among contributors, kinds of part and pairs."""
    missing = run.diagnostics.missing or "not stored in this run"
    unknown = Halved(Estimate(math.nan, reason=missing), 0)
    stored = run.diagnostics.halved.get(response, {})
    contributors = {
        name: Cause(*difference, *stored.get((name,), unknown))
        for name, difference in differing.items()
    }
    members = kinds_of_part(list(differing), run.contributors)
    kinds = {
        kind: Cause(math.nan, math.nan, out_of_limit.of_kind(parts, differing),
                    *stored.get(tuple(parts), unknown))
        for kind, parts in members.items()
    }  # fmt: skip
    paired = tuple(
        PairCause(_in_words(each), each, *stored.get(each.members, unknown))
        for each in together
    )
    reason = ""
    if count == 0:
        reason = NONE
    elif out_of_limit.least_level(count, len(contributors)) >= out_of_limit.CLEAR:
        reason = FEW
    grouped = {part for parts in members.values() for part in parts}
    tested = {n: each for n, each in contributors.items() if n not in grouped} | kinds
    clear = [name for name, each in tested.items() if each.significant]
    leading = tuple(sorted(clear, key=lambda name: tested[name].level))
    return Causes(count, reason, leading, contributors, kinds, paired)
