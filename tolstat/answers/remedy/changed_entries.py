"""What a remedy may change in the study of a run, and its entries after a change."""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from tolstat.deviations.names import means_of_lots
from tolstat.statistics.remedies.change import Change, Design, drawing_step
from tolstat.store.assumed import is_turn
from tolstat.store.stored_run import Run
from tolstat.study.distribution_entry import Entry, typed
from tolstat.study.editor import StudyEditor, together
from tolstat.study.nominal_size import DeviationReader
from tolstat.study.remedy_keys import is_fixed, step_of
from tolstat.study.settings_section import NOMINAL
from tolstat.units.grammar import quantity


class ChangeableEntries(NamedTuple):
    """The entries with a tolerance, in the order of `design`."""

    names: tuple[str, ...]  # as the study has them
    members: tuple[tuple[str, ...], ...]  # contributors
    design: Design

    @property
    def contributors(self) -> list[str]:
        """All contributors, in the order of the design."""
        return [name for members in self.members for name in members]


def changeable_entries(run: Run) -> ChangeableEntries:
    """Return the entries of a run whose parts deviate, and what of them is free."""
    written = _Written(run)
    groups = dict[str, list[str]]()
    for name, assumed in run.assumed.items():
        if assumed.tolerance.half > 0:
            groups.setdefault(assumed.entry, []).append(name)
    means = means_of_lots([*written.parts])
    steps, movable = list[float](), list[bool]()
    for members in groups.values():
        first = members[0]
        part, factor = written.parts[first], run.scales[first].factor
        step = step_of(written.keys(first), part)
        steps.append(step or drawing_step(_half(run, members), factor))
        # no drawing has the mean of a lot
        movable.append(part.gear is None and first not in means)
    idle = (x for x in groups.values() if {*x} <= {*run.diagnostics.idle})
    stays = written.fixed.union(*idle)
    names = tuple(groups)
    entries = np.repeat(np.arange(len(names)), [len(x) for x in groups.values()])
    columns = [name for members in groups.values() for name in members]
    halves = np.array([_half(run, members) for members in groups.values()])
    sizes = np.array([written.least_size(members) for members in groups.values()])
    design = Design(
        np.array([run.assumed[name].centre for name in columns]), entries, halves,
        np.array(steps), np.array([stays.isdisjoint(x) for x in groups.values()]),
        np.array(movable, bool), lowest=1 - sizes / halves,
    )  # fmt: skip
    return ChangeableEntries(names, tuple(map(tuple, groups.values())), design)


def fixed_contributors(run: Run) -> frozenset[str]:
    """Return the contributors that no remedy may change."""
    return _Written(run).fixed


def _half(run: Run, members: list[str]) -> float:
    return max(run.assumed[name].tolerance.half for name in members)


def changed_entries(
    run: Run, entries: ChangeableEntries, change: Change
) -> dict[str, Entry]:
    """Return entries of [deviations] after a change, as what-if takes them.

    A link that is only shifted gets another nominal, an entry with `nominal_shift`
    another one of that; any other tolerance is written as it lies then.
    """
    written, design = _Written(run), entries.design
    changed = dict[str, Entry]()
    for i in sorted({*change.shifted.tolist(), *change.tightened.tolist()}):
        shift, ratio = float(change.shift[i] * design.halves[i]), float(change.ratio[i])
        new = {
            member: written.changed(member, shift=shift, ratio=ratio)
            for member in entries.members[i]
        }
        changed |= together(entries.names[i], new)
    return changed


def typed_tolerance(
    run: Run, member: str, ratio: float = 1.0, *, shift: float = 0.0
) -> str:
    """Return the tolerance of a contributor after a change, as a study types it."""
    part = next(part for part in run.contributors if part.name == member)
    zone = run.assumed[member].changed_zone(shift, ratio)
    return typed(zone, run.scales[member], DeviationReader(part))


class _Written:
    """The entries of the study of a run, read once for all contributors."""

    def __init__(self, run: Run) -> None:
        self.run, self.editor = run, StudyEditor(run.study.table, run.contributors)
        self.parts, self.links = self.editor.parts, self.editor.links
        self._entries = self.editor.entries_of([*run.assumed])

    def keys(self, name: str) -> Mapping[str, Any]:
        """Return the keys of the entry of a contributor."""
        return self._entries[name].keys

    def least_size(self, members: list[str]) -> float:
        """Return the least nominal value, SI, of those above 0; infinite without any.

        A size below 0, or none, may change its sign.
        """
        sizes = (self.parts[name].size for name in members)
        return min((size for size in sizes if size and size > 0), default=math.inf)

    @property
    def fixed(self) -> frozenset[str]:
        """The contributors that are fixed, or deviate by a full turn."""
        return frozenset(
            name
            for name, assumed in self.run.assumed.items()
            if is_fixed(self.keys(name), self.parts[name])
            or is_turn(self.run.units[name], assumed.tolerance)
            or not assumed.has_tolerance
        )

    def changed(self, member: str, *, shift: float, ratio: float) -> Entry:
        """Return the entry of a contributor after a change."""
        run, keys = self.run, self.keys(member)
        assumed, scale = run.assumed[member], run.scales[member]
        if "nominal_shift" in keys and shift:
            reader = DeviationReader(self.parts[member])
            by = typed(assumed.nominal_shift + shift, scale, reader)
            zone = typed_tolerance(run, member, ratio)
            new = self.editor.changed(member, zone)[member].keys if ratio < 1 else keys
            return {k: new[k] for k in new if k != NOMINAL} | {"nominal_shift": by}
        if shift and ratio == 1 and member in self.links:
            size = self.links[member][NOMINAL]
            nominal = scale.factor * (quantity(str(size), scale.unit) + shift)
            return {NOMINAL: f"{nominal:.10g} {scale.mark}".strip()}
        return typed_tolerance(run, member, ratio, shift=shift)
