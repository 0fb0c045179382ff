"""Main causes of the out-of-limit trials of each limit, and of the variance."""

import math
from collections.abc import Callable, Container, Sequence
from itertools import chain
from typing import Any

import numpy as np

from tolstat.answers.report.report_answer import NoCause
from tolstat.answers.report.response_summary import (
    Cause,
    Causes,
    NamedCause,
    SobolIndices,
)
from tolstat.answers.sampled_trials import Drawn
from tolstat.arrays import Truths
from tolstat.model.description import kinds_of_part
from tolstat.statistics.estimate import Estimate, without_interval
from tolstat.statistics.intervals.as_sampled import HEAVY
from tolstat.statistics.point_mass import clipped
from tolstat.statistics.sensitivity.contributions import Contributions, contributions
from tolstat.statistics.sensitivity.named_causes import (
    LEAST,
    MOST,
    TELLING,
    Named,
    NamedCauses,
    equal_parts,
    named_causes,
)
from tolstat.statistics.sensitivity.pairs import BOTH_FAR, DIFFERENCE, SUM, Together
from tolstat.store.assumed import effects_of
from tolstat.store.run_records import Halved
from tolstat.store.stored_run import Run

MOST_IN_WORDS = 4  # parts in a sentence
ROUNDING = 1e-9  # of a share: values above 1 by less are 1
FIXED = " (fixed)"  # after what no remedy may change
WAYS = {
    SUM: "both high, or both low",
    DIFFERENCE: "differ: one high, one low",
    BOTH_FAR: "far from their middle, each of them",
}


def main_causes(drawn: Drawn) -> dict[str, Causes]:
    """Return the causes of out-of-limit trials, failed ones too, for each limit.

    By limited response; empty for weighted trials.
    """
    run, ran = drawn.run, drawn.sample.ran
    if drawn.sample.weights:
        return {}
    out = {name: run.beyond(name)[drawn.trials][ran] for name in run.limits}
    if drawn.sample.replicates:
        return {
            name: Causes(int(trials.sum()), NoCause.RANDOM_ONLY, 0, (), {}, {})
            for name, trials in out.items()
        }
    effects = effects_of(out, run.assumed, run.diagnostics.slopes, run.contributors)
    candidates = named_causes(drawn.deviating(ran), out, effects)
    named = any(causes.parts or causes.pairs for causes in candidates.values())
    fixed = _fixed(run) if named else frozenset[str]()
    return {
        name: _causes(run, name, trials, candidates[name], fixed)
        for name, trials in out.items()
    }


def _causes(
    run: Run, response: str, out: Truths, candidates: NamedCauses, fixed: frozenset[str]
) -> Causes:
    """Return the causes among contributors, equivalent parts and pairs."""
    count, trials = int(out.sum()), len(out)
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
            _in_words(cause, of_kind.get(cause.members, ""), fixed), cause.members,
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
    reason, needed = "", 0
    if count == 0:
        reason = NoCause.NONE_OUT_AT_RANDOM if run.thinned else NoCause.NONE_OUT
    elif count < LEAST:
        reason = f"too few ({count})"
        if run.thinned:  # its random trials do not become more
            reason = f"too few random trials ({count})"
        else:
            digits = 10.0 ** math.floor(math.log10(TELLING * trials / count) - 1)
            needed = int(math.ceil(TELLING * trials / count / digits) * digits)
    elif count > MOST * trials:
        reason = NoCause.MOST_OUT
    return Causes(count, reason, needed, tuple(named), contributors, kinds)


def _fixed(run: Run) -> frozenset[str]:
    from tolstat.answers.remedy.changed_entries import fixed_contributors  # seldom used

    return fixed_contributors(run)


def _in_words(cause: Named | Together, kind: str, fixed: Container[str]) -> str:
    """Return a cause in words; `kind`: of part, if it is all of one."""
    n = len(cause.members)
    names: Sequence[str] = [f"{x}{FIXED * (x in fixed)}" for x in cause.members]
    if n > MOST_IN_WORDS:
        names = [*names[: MOST_IN_WORDS - 1], f"{n - MOST_IN_WORDS + 1} more"]
    if isinstance(cause, Together):
        listed = f"{', '.join(names[:-1])} and {names[-1]}"
        return f"{listed} {WAYS.get(cause.how, 'only together')}"
    if n == 1:
        return names[0]
    parts = f"{kind} ({n} parts, " if kind else f"{', '.join(names)} ("
    why = "correlated: any may be the cause" if cause.correlated else "equivalent"
    return f"{parts}{why})"


def contributions_of(
    drawn: Drawn, focus: Sequence[str]
) -> tuple[dict[str, Contributions], dict[str, dict[str, tuple[str, ...]]]]:
    """Return the contributions to the responses in focus.

    By response, empty where nothing deviates or trials are weighted; and, also by
    response, the contributors of each kind of part, and of parts with equal
    distribution and slope.
    """
    deviations = drawn.deviating(drawn.sample.done)
    if not deviations or drawn.sample.weights:
        return {}, {}
    run = drawn.run
    kinds = kinds_of_part(list(deviations), run.contributors)
    groups, groups_of = dict(kinds), {name: dict(kinds) for name in focus}
    effects = effects_of(focus, run.assumed, run.diagnostics.slopes, run.contributors)
    for response, sizes in effects.items() if run.independent else ():
        for equal in equal_parts({n: sizes[n] for n in deviations if n in sizes}):
            moves = any(sizes[name].size for name in equal)
            if moves and not {*equal} & {*chain.from_iterable(kinds.values())}:
                groups_of[response][", ".join(equal)] = list(equal)
        groups |= groups_of[response]
    responses = {name: drawn.done(name) for name in focus}
    independent, by_response = run.independent, dict[str, Contributions]()
    for name, raw in contributions(
        deviations, responses, groups, independent=independent
    ).items():
        shares = _changed(raw, at_most_all)  # overlapping ones may sum to more
        sums = shares.groups if independent else raw.groups
        shares = shares._replace(
            rank_regression=raw.rank_regression,
            groups={group: sums[group] for group in groups_of[name]},
            together={group: shares.together[group] for group in groups_of[name]},
        )
        if drawn.sample.replicates:
            shares = _changed(shares, without_interval)
        by_response[name] = shares
    return by_response, {
        name: {group: tuple(members) for group, members in of_response.items()}
        for name, of_response in groups_of.items()
    }


def at_most_all(share: Estimate) -> Estimate:
    """Return a share of a variance, limited to 100 %."""
    if share.lower > 1 + ROUNDING:
        return Estimate(1.0, reason="estimated above 100 %")
    value, lower, upper = (min(x, 1.0) for x in share[:3])  # NaN stays NaN
    return Estimate(value, lower, upper, share.reason)


def _changed(
    contributions: Contributions, change: Callable[[Estimate], Estimate]
) -> Contributions:
    """Change all estimates of contributions."""

    def changed(value: object) -> Any:
        if isinstance(value, dict):
            return {name: change(share) for name, share in value.items()}
        return change(value) if isinstance(value, Estimate) else value

    return Contributions(*map(changed, contributions))


def indices_of(drawn: Drawn, name: str) -> SobolIndices:
    """Return Sobol' indices of a response of a run with sampling = "saltelli".

    Groups with a failed trial are left out and counted.
    """
    from tolstat.statistics.sensitivity.sobol_indices import sobol_indices

    groups = drawn.groups(name)
    by_factor = sobol_indices(groups, drawn.group_surface)
    indices = dict(zip(drawn.sampled.factors, by_factor, strict=True))
    return SobolIndices(
        len(groups),
        int(np.count_nonzero(~drawn.whole_groups)),
        {factor: at_most_all(index.first) for factor, index in indices.items()},
        {factor: at_most_all(index.total) for factor, index in indices.items()},
        any(index.first.reason == HEAVY for index in indices.values()),
        bool(len(groups)) and not clipped(groups, groups[:, :2]).light,
    )
