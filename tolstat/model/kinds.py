"""Contributors sorted by the kind of part that they belong to."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from tolstat.model.description import Contributor


def kinds_of_part(
    names: Sequence[str], contributors: Iterable[Contributor]
) -> dict[str, list[str]]:
    """Sort contributors by the kind of part, else by their name without number.

    `names` are those that deviate; a kind has two of them or more.
    """
    parts = {each.name: each.part for each in contributors}
    found: dict[str, list[str]] = {}
    for name in names:
        stem, _, number = name.rpartition("_")
        kind = parts[name] or (stem if number.isdigit() else name)
        found.setdefault(kind, []).append(name)
    return {kind: members for kind, members in found.items() if len(members) > 1}
