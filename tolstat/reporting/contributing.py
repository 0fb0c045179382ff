"""Contributions to responses: from the trials at hand, or made for them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from tolstat.model.kinds import kinds_of_part
from tolstat.reporting.drawn import Drawn
from tolstat.reporting.findings import IndicesFindings
from tolstat.statistics.contributions import Contributions, contributions
from tolstat.statistics.estimate import RANDOM_ONLY, Estimate
from tolstat.statistics.jackknife import HEAVY
from tolstat.statistics.total_indices import sobol_indices


def contributions_of(
    drawn: Drawn, interest: Sequence[str]
) -> tuple[dict[str, Contributions], dict[str, tuple[str, ...]]]:
    """Estimate the contributions to what is looked at closely.

    Parameters
    ----------
    drawn : Drawn
        The trials.
    interest : sequence of str
        Names of responses.

    Returns
    -------
    tuple of dict
        By response; empty where nothing deviates. And the contributors of each kind of
        part.
    """
    deviations = {}
    for contributor in drawn.run.contributors:
        column = drawn.done(contributor.name)
        if len(column) and np.ptp(column) > 0:
            deviations[contributor.name] = column
    if not deviations:
        return {}, {}
    groups = kinds_of_part(list(deviations), drawn.run.contributors)
    responses = {name: drawn.done(name) for name in interest}
    independent = not hanging_together(drawn.run.study.table)
    found = contributions(deviations, responses, groups, independent=independent)
    if drawn.sample.replicates:
        found = {name: _without_intervals(each) for name, each in found.items()}
    return found, {name: tuple(members) for name, members in groups.items()}


def hanging_together(study: Mapping[str, Any]) -> bool:
    """Tell whether a study (as TOML) has deviations correlated, or of one batch."""
    lines = [*study.get("deviations", {}).values(), *study.get("links", {}).values()]
    batches = any(isinstance(line, dict) and line.get("common") for line in lines)
    return batches or bool(study.get("correlation"))


def _without_intervals(found: Contributions) -> Contributions:
    """Leave out what a jackknife says: trials that know of each other mislead it."""

    def one(each: Estimate) -> Estimate:
        return Estimate(each.value, reason=RANDOM_ONLY) if each.sure else each

    def every(shares: Mapping[str, Estimate]) -> dict[str, Estimate]:
        return {name: one(each) for name, each in shares.items()}

    return found._replace(
        rank_regression=every(found.rank_regression),
        explained=one(found.explained),
        first_order=every(found.first_order),
        groups=every(found.groups),
        together=every(found.together),
        unexplained=one(found.unexplained),
    )


def indices_of(drawn: Drawn, name: str) -> IndicesFindings:
    """Estimate Sobol' indices of a run that was made for them.

    Parameters
    ----------
    drawn : Drawn
        Of a run with sampling = "saltelli".
    name : str
        Of a response.

    Returns
    -------
    IndicesFindings
        Groups with a failed trial are left out and counted.
    """
    groups, broken = drawn.groups(name)
    found = sobol_indices(groups, list(drawn.sampled.factors))
    return IndicesFindings(
        len(groups),
        broken,
        {factor: each.first for factor, each in found.items()},
        {factor: each.total for factor, each in found.items()},
        any(each.first.reason == HEAVY for each in found.values()),
    )
