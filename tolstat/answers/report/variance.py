"""Variance contributions, from any trials or from those sampled for indices."""

from collections.abc import Callable, Sequence
from typing import Any

from tolstat.answers.report.report_answer import SobolIndices
from tolstat.answers.sampled_trials import Drawn
from tolstat.execution.diagnostics.halved_tolerances import effects_of
from tolstat.model.description import kinds_of_part
from tolstat.statistics.estimate import Estimate, without_interval
from tolstat.statistics.intervals.jackknife import HEAVY
from tolstat.statistics.sensitivity.clipping import clipped
from tolstat.statistics.sensitivity.contributions import Contributions, contributions
from tolstat.statistics.sensitivity.named_causes import equal_parts
from tolstat.statistics.sensitivity.sobol_indices import sobol_indices

ROUNDING = 1e-9  # of a share: values above 1 by less are 1


def contributions_of(
    drawn: Drawn, focus: Sequence[str]
) -> tuple[dict[str, Contributions], dict[str, tuple[str, ...]]]:
    """Return the contributions to the responses in focus.

    By response, empty where nothing deviates; and the contributors of each kind of
    part, and of parts with equal distribution and slope.
    """
    deviations = drawn.deviating(drawn.sample.done)
    if not deviations:
        return {}, {}
    run = drawn.run
    groups = kinds_of_part(list(deviations), run.contributors)
    effects = effects_of(focus, run.assumed, run.diagnostics.slopes, run.contributors)
    for known in effects.values() if run.independent else ():
        for equal in equal_parts({n: known[n] for n in deviations if n in known}):
            moves = any(known[name].size for name in equal)
            if moves and not {*equal} & {n for each in groups.values() for n in each}:
                groups[", ".join(equal)] = list(equal)
    responses = {name: drawn.done(name) for name in focus}
    independent = run.independent
    found = contributions(deviations, responses, groups, independent=independent)
    for name, each in found.items():
        shares = _of_each(at_most_all, each)  # overlapping ones may sum to more
        own = shares.groups if independent else each.groups
        shares = shares._replace(rank_regression=each.rank_regression, groups=own)
        if drawn.sample.replicates:
            shares = _of_each(without_interval, shares)
        found[name] = shares
    return found, {name: tuple(members) for name, members in groups.items()}


def at_most_all(share: Estimate) -> Estimate:
    """Return a share of a variance, limited to 100 %."""
    if share.lower > 1 + ROUNDING:
        return Estimate(1.0, reason="estimated above 100 %")
    value, lower, upper = (min(x, 1.0) for x in share[:3])  # NaN stays NaN
    return Estimate(value, lower, upper, share.reason)


def _of_each(
    change: Callable[[Estimate], Estimate], found: Contributions
) -> Contributions:
    """Change all estimates of contributions."""

    def changed(given: object) -> Any:
        if isinstance(given, dict):
            return {name: change(each) for name, each in given.items()}
        return change(given) if isinstance(given, Estimate) else given

    return Contributions(*map(changed, found))


def indices_of(drawn: Drawn, name: str) -> SobolIndices:
    """Return Sobol' indices of a response of a run with sampling = "saltelli".

    Groups with a failed trial are left out and counted.
    """
    groups, broken = drawn.groups(name)
    found = sobol_indices(groups, list(drawn.sampled.factors))
    return SobolIndices(
        len(groups),
        broken,
        {factor: at_most_all(each.first) for factor, each in found.items()},
        {factor: at_most_all(each.total) for factor, each in found.items()},
        any(each.first.reason == HEAVY for each in found.values()),
        bool(len(groups)) and not clipped(groups, groups[:, :2]).light,
    )
