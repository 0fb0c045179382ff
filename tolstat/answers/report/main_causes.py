"""Main causes of the out-of-limit trials of each limit."""

import math
from collections.abc import Sequence

from tolstat.answers.halved_entries import halved_entries
from tolstat.answers.report.report_answer import NoCause
from tolstat.answers.report.response_summary import Cause, Causes, NamedCause
from tolstat.answers.sampled_trials import Drawn
from tolstat.execution.diagnostics.influence import effects_of
from tolstat.model.description import kinds_of_part
from tolstat.statistics.estimate import Estimate
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

MOST_IN_WORDS = 4  # parts in a sentence
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
            name: Causes(int(trials.sum()), NoCause.RANDOM_ONLY, 0, (), {}, {})
            for name, trials in out.items()
        }
    effects = effects_of(out, run.assumed, run.diagnostics.slopes, run.contributors)
    candidates = named_causes(drawn.deviating(ran), out, effects)
    return {
        name: _causes(run, name, int(trials.sum()), len(trials), candidates[name])
        for name, trials in out.items()
    }


def _causes(
    run: Run, response: str, count: int, trials: int, candidates: NamedCauses
) -> Causes:
    """Return the causes among contributors, equivalent parts and pairs."""
    missing = run.diagnostics.missing or "not stored in this run"
    unknown = Halved(Estimate(math.nan, reason=missing), 0)
    stored = run.diagnostics.halved.get(response, {})
    contributors = {
        name: Cause(*difference, *stored.get((name,), unknown))
        for name, difference in candidates.differences.items()
    }
    members = kinds_of_part(list(contributors), run.contributors)
    levels = {tuple(part.members): part.level for part in candidates.parts}
    kinds = {
        kind: Cause(math.nan, math.nan, levels.get(
            tuple(parts), max(contributors[n].level for n in parts)
        ), *stored.get(tuple(parts), unknown))
        for kind, parts in members.items()
    }  # fmt: skip
    of_kind = {tuple(parts): kind for kind, parts in members.items()}
    together = {pair.members: pair for pair in candidates.pairs}
    ordered: list[Named | Together] = [
        *(pair for pair in candidates.pairs if pair.far.value > pair.single),
        *(part for part in candidates.parts if part.members not in together),
        *(pair for pair in candidates.pairs if pair.far.value <= pair.single),
    ]
    named = [
        NamedCause(
            _in_words(cause, of_kind.get(cause.members, "")), cause.members,
            cause.level, *stored.get(cause.members, unknown),
            together.get(cause.members),
        )
        for cause in ordered
    ]  # fmt: skip
    permitted = 1 - run.limits[response].demanded
    if count > permitted * trials:  # the least change that meets the limit comes first
        meets = [cause for cause in named if cause.halved.upper <= permitted]
        meets.sort(key=lambda cause: (len(cause.members), cause.halved.value))
        named = [*meets, *(cause for cause in named if cause not in meets)]
    # a phase over a full turn, or measured parts, have no tolerance to change
    named.sort(key=lambda cause: not halved_entries(run, cause.members))
    reason, needed = "", 0
    if count == 0:
        reason = NoCause.NONE_OUT
    elif count < LEAST:
        digits = 10.0 ** math.floor(math.log10(TELLING * trials / count) - 1)
        needed = int(math.ceil(TELLING * trials / count / digits) * digits)
        reason = f"too few ({count})"
    elif count > MOST * trials:
        reason = NoCause.MOST_OUT
    return Causes(count, reason, needed, tuple(named), contributors, kinds)


def _in_words(cause: Named | Together, kind: str) -> str:
    """Return a cause in words; `kind`: of part, if it is all of one."""
    n = len(cause.members)
    names: Sequence[str] = cause.members
    if n > MOST_IN_WORDS:
        names = [*names[: MOST_IN_WORDS - 1], f"{n - MOST_IN_WORDS + 1} more"]
    if isinstance(cause, Together):
        listed = f"{', '.join(names[:-1])} and {names[-1]}"
        return f"{listed} {WAYS.get(cause.how, 'only together')}"
    if n == 1:
        return cause.members[0]
    parts = f"{kind} ({n} parts, " if kind else f"{', '.join(names)} ("
    why = "correlated: any may be the cause" if cause.correlated else "equivalent"
    return f"{parts}{why})"
