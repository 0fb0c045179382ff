"""Entries of the study of a run, and the same with half their tolerance."""

from collections.abc import Mapping, Sequence
from typing import Any

from tolstat.deviations.distributions import Tolerance
from tolstat.deviations.spread import fixed_point, unshifted, zone_of
from tolstat.execution.diagnostics.influence import is_turn
from tolstat.model.description import Contributor
from tolstat.store.stored_run import Run
from tolstat.study.distribution_entry import (
    KEYS,
    MOVED,
    distribution_of,
    has_tolerance,
    keys_of,
    shortest,
    typed,
    with_tolerance,
)
from tolstat.study.editor import StudyEditor, together
from tolstat.study.nominal_size import DeviationReader


def editor_of(run: Run) -> StudyEditor:
    """Return the editor of the study of a run."""
    return StudyEditor(run.study.table, run.contributors)


def halved_entries(run: Run, parts: Sequence[str]) -> dict[str, Any]:
    """Return entries of [deviations] that halve the tolerances of parts, by name.

    Each deviation halves as in `tolstat.deviations.spread.halved`. All parts of an
    entry that halve stand together. A full turn stays. Empty if one of the parts has
    no tolerance, as measured ones.
    """
    editor, entries = editor_of(run), dict[str, Any]()
    for entry in editor.entries():
        members = [name for name in entry.members if name in parts]
        halved = dict[str, Any]()
        for name in members:
            if is_turn(run.units[name], Tolerance(*run.assumed[name].tolerance)):
                continue
            if not has_tolerance(entry.keys):
                return {}
            part = editor.parts[name]
            keys = with_tolerance(entry.keys, _half(run, entry.keys, part), part)
            halved[name] = shortest({k: x for k, x in keys.items() if k in KEYS})
        if halved and (entry.splits(members) or {*members} == {*entry.members}):
            halved = together(entry.name, halved)
        entries |= halved
    return entries


def common_tolerance(entries: Mapping[str, str | dict[str, Any]]) -> str:
    """Return the tolerance of all entries.

    Empty if they differ, or where a tolerance alone is no remedy: other keys have to
    change with it.
    """
    alone = all(isinstance(e, str) or not e.keys() & {*MOVED} for e in entries.values())
    tolerances = {str(keys_of(entry)["tolerance"]) for entry in entries.values()}
    return tolerances.pop() if alone and len(tolerances) == 1 else ""


def nominal_shift(entry: Mapping[str, Any], part: Contributor) -> float:
    """Return the `nominal_shift` of an entry of [deviations] or [links], SI."""
    shift = entry.get("nominal_shift")
    return DeviationReader(part).deviation(str(shift)) if shift else 0.0


def fixed_points(run: Run) -> dict[str, float]:
    """Return the deviation, SI, about which the zone of contributors narrows, by name.

    That of measured parts, which have no tolerance, is not in it.
    """
    parts = {part.name: part for part in run.contributors}
    return {
        name: _fixed_point(entry.keys, parts[name])
        for entry in editor_of(run).entries()
        if has_tolerance(entry.keys)
        for name in entry.members
        if name in run.assumed  # not a link that has a size alone
    }


def _fixed_point(keys: Mapping[str, Any], part: Contributor) -> float:
    sized = DeviationReader(part).is_sized(keys)
    return fixed_point(distribution_of(keys, part), sized=sized)


def _half(run: Run, keys: Mapping[str, Any], part: Contributor) -> str:
    """Return half the tolerance of an entry as typed, beside its shift."""
    distribution, reader = unshifted(distribution_of(keys, part)), DeviationReader(part)
    zone = zone_of(distribution)
    assert zone is not None  # the entry has a tolerance
    fixed = fixed_point(distribution, sized=reader.is_sized(keys))
    ends = [fixed + 0.5 * (end - fixed) for end in zone]
    return typed(ends, run.scales[part.name], reader)
