"""Contributions as plain data: from the trials at hand, or made for them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from tolstat.report.drawn import Drawn
from tolstat.report.plain import Found, estimate
from tolstat.statistics.contributions import Contributions, contributions
from tolstat.statistics.estimate import RANDOM_ONLY, Estimate
from tolstat.statistics.total_indices import sobol_indices
from tolstat.store.run import Run


def contributions_found(drawn: Drawn, interest: Sequence[str]) -> dict[str, Found]:
    """Estimate the contributions to what is looked at closely.

    Parameters
    ----------
    drawn : Drawn
        The trials.
    interest : sequence of str
        Names of responses.

    Returns
    -------
    dict of str to dict
        By response, plain data; empty where nothing deviates.
    """
    done = drawn.sample.done
    deviations = {}
    for contributor in drawn.run.contributors:
        column = drawn.values(contributor.name)[done]
        if len(column) and np.ptp(column) > 0:
            deviations[contributor.name] = column
    if not deviations:
        return {name: {} for name in interest}
    groups = groups_of(list(deviations), drawn.run)
    responses = {name: drawn.values(name)[done] for name in interest}
    found = contributions(deviations, responses, groups)
    independent = not drawn.sample.replicates
    return {name: _shares(each, groups, independent) for name, each in found.items()}


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


def _shares(
    found: Contributions, groups: dict[str, list[str]], independent: bool
) -> Found:
    def plain(each: Estimate) -> Found:
        # the jackknife leaves out trials as if they knew nothing of each other
        if each.sure and not independent:
            each = Estimate(each.value, reason=RANDOM_ONLY)
        return estimate(each)

    def all_of(shares: Mapping[str, Estimate]) -> dict[str, Found]:
        return {name: plain(each) for name, each in shares.items()}

    return {
        "first_order": all_of(found.first_order),
        "members": {name: list(members) for name, members in groups.items()},
        "groups": all_of(found.groups),
        "together": all_of(found.together),
        "unexplained": plain(found.unexplained),
        "rank_regression": all_of(found.rank_regression),
        "explained_by_ranks": plain(found.explained),
    }


def indices_found(drawn: Drawn, name: str) -> Found:
    """Estimate Sobol' indices of a run that was made for them.

    Parameters
    ----------
    drawn : Drawn
        Of a run with sampling = "saltelli".
    name : str
        Of a response.

    Returns
    -------
    dict
        Plain data; groups with a failed trial are left out and counted.
    """
    groups, broken = drawn.groups(name)
    found = sobol_indices(groups, drawn.run.facts["factors"].split())
    return {
        "groups": len(groups),
        "broken": broken,
        "first": {factor: estimate(each.first) for factor, each in found.items()},
        "total": {factor: estimate(each.total) for factor, each in found.items()},
    }


def leading_contributors(found: Found, most: int = 3) -> list[str]:
    """Name the contributors that matter most to a response, of its findings."""
    shares = found.get("contributions", {}).get("first_order", {})
    known = {n: e["value"] for n, e in shares.items() if e["value"] is not None}
    return sorted(known, key=lambda name: -known[name])[:most]
