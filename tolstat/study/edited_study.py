"""A study with other entries of [deviations], [links] and [limits]."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from tolstat.deviations.names import expand
from tolstat.model.contract import Model
from tolstat.study.links_section import with_deviation

Entry = str | Mapping[str, Any]


def with_deviations(
    table: Mapping[str, Any],
    given: Mapping[str, Entry],
    contributors: Sequence[str],
    model: Model,
) -> dict[str, Any]:
    """Return a study with other deviations; batches and correlations stay.

    Parameters
    ----------
    table : mapping
        The study.
    given : mapping of str to str or mapping
        Entries as of [deviations], by contributor or by several of one name.
    contributors : sequence of str
        All names.
    model : Model
        The machine.
    """
    links = dict(table.get("links", {}))
    others = dict(given)
    for name, entry in given.items():
        members = expand(name, contributors)
        if set(members) & set(links):
            del others[name]
            links |= {n: with_deviation(links[n], entry, model) for n in members}
    deviations = _replaced(table.get("deviations", {}), others, contributors, _like)
    sections = {"links": links, "deviations": deviations}
    return {**table, **{name: each for name, each in sections.items() if each}}


def with_limits(
    table: Mapping[str, Any], given: Mapping[str, Entry], responses: Sequence[str]
) -> dict[str, Any]:
    """Return a study with other limits; their demanded yields stay."""
    limits = _replaced(table.get("limits", {}), given, responses, _demanding)
    return {**table, "limits": limits}


def _replaced(
    before: Mapping[str, Any],
    given: Mapping[str, Entry],
    known: Sequence[str],
    like: Callable[[Any, Entry], str | dict[str, Any]],
) -> dict[str, Any]:
    """Return a section with other entries; the rest of a group keeps the old entry."""
    every = dict(before)
    for name, entry in given.items():
        members = expand(name, known)
        gone = [n for n in every if set(expand(n, known)) & set(members)]
        own = {other: every.pop(other) for other in gone}
        every[name] = like(next(iter(own.values()), None), entry)
        for other, its in own.items():
            rest = [n for n in expand(other, known) if n not in members]
            every |= dict.fromkeys(rest, its)
    return every


def _demanding(before: Any, entry: Entry) -> str | dict[str, Any]:
    """Return a limit with the demanded yield of the one before, if it names none."""
    if not isinstance(entry, str):
        return dict(entry)
    return {**before, "limit": entry} if isinstance(before, Mapping) else entry


def _like(before: Any, entry: Entry) -> str | dict[str, Any]:
    """Return an entry with the batch of the one before."""
    common = before.get("common") if isinstance(before, Mapping) else None
    if common is None:
        return entry if isinstance(entry, str) else dict(entry)
    keys = {"tolerance": entry} if isinstance(entry, str) else dict(entry)
    return {**keys, "common": common}
