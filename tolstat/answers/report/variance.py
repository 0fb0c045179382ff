"""Variance contributions, from any trials or from those sampled for indices."""

from collections.abc import Callable, Sequence
from itertools import chain
from typing import Any

from tolstat.answers.report.response_summary import SobolIndices
from tolstat.answers.sampled_trials import Drawn
from tolstat.execution.diagnostics.influence import effects_of
from tolstat.model.description import kinds_of_part
from tolstat.statistics.estimate import Estimate, without_interval
from tolstat.statistics.intervals.as_sampled import HEAVY
from tolstat.statistics.point_mass import clipped
from tolstat.statistics.sensitivity.contributions import Contributions, contributions
from tolstat.statistics.sensitivity.named_causes import equal_parts

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
    for sizes in effects.values() if run.independent else ():
        for equal in equal_parts({n: sizes[n] for n in deviations if n in sizes}):
            moves = any(sizes[name].size for name in equal)
            if moves and not {*equal} & {*chain.from_iterable(groups.values())}:
                groups[", ".join(equal)] = list(equal)
    responses = {name: drawn.done(name) for name in focus}
    independent, by_response = run.independent, dict[str, Contributions]()
    for name, raw in contributions(
        deviations, responses, groups, independent=independent
    ).items():
        shares = _changed(raw, at_most_all)  # overlapping ones may sum to more
        groups_of = shares.groups if independent else raw.groups
        shares = shares._replace(rank_regression=raw.rank_regression, groups=groups_of)
        if drawn.sample.replicates:
            shares = _changed(shares, without_interval)
        by_response[name] = shares
    return by_response, {kind: tuple(members) for kind, members in groups.items()}


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
    # what no other sampling needs
    from tolstat.statistics.sensitivity.sobol_indices import sobol_indices

    groups, broken = drawn.groups(name)
    indices = sobol_indices(groups, list(drawn.sampled.factors))
    return SobolIndices(
        len(groups),
        broken,
        {factor: at_most_all(index.first) for factor, index in indices.items()},
        {factor: at_most_all(index.total) for factor, index in indices.items()},
        any(index.first.reason == HEAVY for index in indices.values()),
        bool(len(groups)) and not clipped(groups, groups[:, :2]).light,
    )
