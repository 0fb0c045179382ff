"""A study with other lines of deviations: what is written, and in place of what."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from tolstat.deviations.names import expand
from tolstat.model.contract import Model
from tolstat.study.links import with_deviation


class Otherwise(NamedTuple):
    """A study with other lines of deviations.

    Attributes
    ----------
    table : dict
        All of it.
    written : dict of str to dict
        Its new lines, by section: "links", "deviations".
    replaced : tuple of str
        Lines of [deviations] of other names that are no longer there.
    """

    table: dict[str, Any]
    written: dict[str, dict[str, Any]]
    replaced: tuple[str, ...]


def with_deviations(
    table: Mapping[str, Any],
    asked: Mapping[str, str | Mapping[str, Any]],
    known: Sequence[str],
    model: Model,
) -> Otherwise:
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
    """
    links, lines = dict(table.get("links", {})), dict(table.get("deviations", {}))
    written: dict[str, dict[str, Any]] = {"links": {}, "deviations": {}}
    replaced = []
    for name, line in asked.items():
        members = expand(name, known)
        if set(members) & set(links):
            for each in members:
                written["links"][each] = with_deviation(links[each], line, model)
            continue
        before = [n for n in lines if set(expand(n, known)) & set(members)]
        written["deviations"][name] = _like(lines.get(name), line)
        for other in before:
            own = lines.pop(other)
            if other != name:
                replaced.append(other)
                rest = [n for n in expand(other, known) if n not in members]
                lines |= dict.fromkeys(rest, own)
                written["deviations"] |= dict.fromkeys(rest, own)
        lines[name] = written["deviations"][name]
    sections = {"links": links | written["links"], "deviations": lines}
    return Otherwise(
        {**table, **{section: each for section, each in sections.items() if each}},
        {section: each for section, each in written.items() if each},
        tuple(replaced),
    )


def _like(before: Any, line: str | Mapping[str, Any]) -> str | dict[str, Any]:
    """Return a line whose parts have in common what those of the line before have."""
    common = before.get("common") if isinstance(before, Mapping) else None
    if common is None:
        return line if isinstance(line, str) else dict(line)
    keys = {"tolerance": line} if isinstance(line, str) else dict(line)
    return {**keys, "common": common}
