"""Main causes of the out-of-limit trials of each limit."""

import math
from collections.abc import Sequence

from tolstat.answers.halved_entries import halved_entries
from tolstat.answers.report.report_answer import Cause, Causes, NamedCause
from tolstat.answers.sampled_trials import Drawn
from tolstat.execution.diagnostics.halved_tolerances import effects_of
from tolstat.model.description import kinds_of_part
from tolstat.statistics.estimate import RANDOM_ONLY, Estimate
from tolstat.statistics.sensitivity.named_causes import (
    LEAST,
    MOST,
    TELLING,
    Named,
    NamedCauses,
    named_causes,
)
from tolstat.statistics.sensitivity.pairs import BOTH_FAR, DIFFERENCE, SUM, Together
from tolstat.store.run_records import Halved
from tolstat.store.stored_run import Run

NONE = "no trial out of limit"
TOO_MANY = "not named: most trials are out of limit"
MOST_NAMED = 4  # parts in a sentence
WAYS = {
    SUM: "both high, or both low",
    DIFFERENCE: "differ: one high, one low",
    BOTH_FAR: "far from their middle, each of them",
}


def main_causes(drawn: Drawn) -> dict[str, Causes]:
    """Return the causes of out-of-limit trials, failed ones too, for each limit.

    By limited response.
    """
    run, ran = drawn.run, drawn.sample.ran
    out = {name: run.beyond(name)[drawn.trials][ran] for name in run.limits}
    if drawn.sample.replicates:
        return {
            name: Causes(int(each.sum()), RANDOM_ONLY, 0, (), {}, {})
            for name, each in out.items()
        }
    effects = effects_of(out, run.assumed, run.diagnostics.slopes, run.contributors)
    found = named_causes(drawn.deviating(ran), out, effects)
    return {
        name: _causes(run, name, int(each.sum()), len(each), found[name])
        for name, each in out.items()
    }


def _causes(
    run: Run, response: str, count: int, trials: int, found: NamedCauses
) -> Causes:
    """Return the causes among contributors, equivalent parts and pairs."""
    missing = run.diagnostics.missing or "not stored in this run"
    unknown = Halved(Estimate(math.nan, reason=missing), 0)
    stored = run.diagnostics.halved.get(response, {})
    contributors = {
        name: Cause(*difference, *stored.get((name,), unknown))
        for name, difference in found.differences.items()
    }
    members = kinds_of_part(list(contributors), run.contributors)
    whole = {tuple(each.members): each.level for each in found.parts}
    kinds = {
        kind: Cause(math.nan, math.nan, whole.get(
            tuple(parts), max(contributors[n].level for n in parts)
        ), *stored.get(tuple(parts), unknown))
        for kind, parts in members.items()
    }  # fmt: skip
    of_kind = {tuple(parts): kind for kind, parts in members.items()}
    together = {each.members: each for each in found.pairs}
    every: list[Named | Together] = [
        *(each for each in found.pairs if each.far.value > each.single),
        *(each for each in found.parts if each.members not in together),
        *(each for each in found.pairs if each.far.value <= each.single),
    ]
    named = [
        NamedCause(
            _in_words(each, of_kind.get(each.members, "")), each.members, each.level,
            *stored.get(each.members, unknown), together.get(each.members),
        )
        for each in every
    ]  # fmt: skip
    permitted = 1 - run.limits[response].demanded
    if count > permitted * trials:  # the least change that meets the limit comes first
        meets = [each for each in named if each.halved.upper <= permitted]
        meets.sort(key=lambda each: (len(each.members), each.halved.value))
        named = [*meets, *(each for each in named if each not in meets)]
    # a phase over a full turn, or measured parts, have no tolerance to change
    named.sort(key=lambda each: not halved_entries(run, each.members))
    reason, needed = "", 0
    if count == 0:
        reason = NONE
    elif count < LEAST:
        digits = 10.0 ** math.floor(math.log10(TELLING * trials / count) - 1)
        needed = int(math.ceil(TELLING * trials / count / digits) * digits)
        reason = f"too few ({count})"
    elif count > MOST * trials:
        reason = TOO_MANY
    return Causes(count, reason, needed, tuple(named), contributors, kinds)


def _in_words(found: Named | Together, kind: str) -> str:
    """Return a cause in words; `kind`: of part, if it is all of one."""
    n = len(found.members)
    names: Sequence[str] = found.members
    if n > MOST_NAMED:
        names = [*names[: MOST_NAMED - 1], f"{n - MOST_NAMED + 1} more"]
    if isinstance(found, Together):
        listed = f"{', '.join(names[:-1])} and {names[-1]}"
        return f"{listed} {WAYS.get(found.how, 'only together')}"
    if n == 1:
        return found.members[0]
    said = f"{kind} ({n} parts" if kind else f"{', '.join(names)} ("
    joint = ", " if kind else ""
    why = "correlated: any may be the cause" if found.correlated else "equivalent"
    return f"{said}{joint}{why})"
