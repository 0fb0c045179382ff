"""Contributions to responses: from the trials at hand, or made for them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from tolstat.reporting.drawn import Drawn
from tolstat.reporting.findings import IndicesFindings
from tolstat.statistics.contributions import Contributions, contributions
from tolstat.statistics.estimate import RANDOM_ONLY, Estimate
from tolstat.statistics.total_indices import sobol_indices
from tolstat.store.run import Run


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
    groups = groups_of(list(deviations), drawn.run)
    responses = {name: drawn.done(name) for name in interest}
    found = contributions(deviations, responses, groups)
    if drawn.sample.replicates:
        found = {name: _without_intervals(each) for name, each in found.items()}
    return found, {name: tuple(members) for name, members in groups.items()}


def groups_of(names: Sequence[str], run: Run) -> dict[str, list[str]]:
    """Sort contributors by the kind of part, else by their name without number.

    Parameters
    ----------
    names : sequence of str
        Contributors that deviate.
    run : Run
        Whose model says which part each belongs to.

    Returns
    -------
    dict of str to list of str
        Groups of two or more.
    """
    parts = {each.name: each.part for each in run.contributors}
    found: dict[str, list[str]] = {}
    for name in names:
        stem, _, number = name.rpartition("_")
        group = parts[name] or (stem if number.isdigit() else name)
        found.setdefault(group, []).append(name)
    return {group: members for group, members in found.items() if len(members) > 1}


def _without_intervals(found: Contributions) -> Contributions:
    """Leave out what a jackknife says: trials that know of each other mislead it."""

    def one(each: Estimate) -> Estimate:
        return Estimate(each.value, reason=RANDOM_ONLY) if each.sure else each

    def every(shares: Mapping[str, Estimate]) -> dict[str, Estimate]:
        return {name: one(each) for name, each in shares.items()}

    return Contributions(
        every(found.rank_regression),
        one(found.explained),
        every(found.first_order),
        every(found.groups),
        every(found.together),
        one(found.unexplained),
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
    )
