"""A study with other lines: what is written, and in place of what."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

from tolstat.deviations.names import expand
from tolstat.model.contract import Model
from tolstat.study.links_section import with_deviation


class Lines(NamedTuple):
    """A section of a study with other lines.

    Attributes
    ----------
    every : dict
        All of it.
    written : dict
        Its new lines.
    replaced : tuple of str
        Lines that there were and that are not as they were.
    """

    every: dict[str, Any]
    written: dict[str, Any]
    replaced: tuple[str, ...]


def with_deviations(
    table: Mapping[str, Any],
    asked: Mapping[str, str | Mapping[str, Any]],
    known: Sequence[str],
    model: Model,
) -> dict[str, Lines]:
    """Write other deviations into a study; what hangs together stays so.

    Parameters
    ----------
    table : mapping
        The study.
    asked : mapping of str to str or mapping
        Lines as of [deviations], by contributor or by several of one name.
    known : sequence of str
        All contributors.
    model : Model
        The machine.

    Returns
    -------
    dict of str to Lines
        By section: "links", "deviations".
    """
    links = table.get("links", {})
    others, linked = dict(asked), dict[str, Any]()
    for name, line in asked.items():
        members = expand(name, known)
        if set(members) & set(links):
            del others[name]
            linked |= {n: with_deviation(links[n], line, model) for n in members}
    sections = {
        "links": Lines(links | linked, linked, tuple(linked)),
        "deviations": _in_place(table.get("deviations", {}), others, known, _like),
    }
    return {section: each for section, each in sections.items() if each.written}


def with_limits(
    table: Mapping[str, Any],
    asked: Mapping[str, str | Mapping[str, Any]],
    known: Sequence[str],
) -> Lines:
    """Write other limits of responses into a study; what it demands of them stays."""
    return _in_place(table.get("limits", {}), asked, known, _demanding)


def _in_place(
    before: Mapping[str, Any],
    asked: Mapping[str, str | Mapping[str, Any]],
    known: Sequence[str],
    like: Callable[[Any, str | Mapping[str, Any]], str | dict[str, Any]],
) -> Lines:
    """Write other lines into a section; what they leave of several keeps its own."""
    every, written = dict(before), dict[str, Any]()
    for name, line in asked.items():
        members = expand(name, known)
        gone = [n for n in every if set(expand(n, known)) & set(members)]
        own = {other: every.pop(other) for other in gone}
        new = {name: like(next(iter(own.values()), None), line)}
        for other, its in own.items():
            rest = [n for n in expand(other, known) if n not in members]
            new |= dict.fromkeys(rest, its)
        every |= new
        written |= new
    kept = every.keys() - written.keys()
    return Lines(every, written, tuple(name for name in before if name not in kept))


def _demanding(before: Any, line: str | Mapping[str, Any]) -> str | dict[str, Any]:
    """Return a limit that demands what the one before does, where it says nothing."""
    if not isinstance(line, str):
        return dict(line)
    return {**before, "limit": line} if isinstance(before, Mapping) else line


def _like(before: Any, line: str | Mapping[str, Any]) -> str | dict[str, Any]:
    """Return a line whose parts have in common what those of the line before have."""
    common = before.get("common") if isinstance(before, Mapping) else None
    if common is None:
        return line if isinstance(line, str) else dict(line)
    keys = {"tolerance": line} if isinstance(line, str) else dict(line)
    return {**keys, "common": common}
