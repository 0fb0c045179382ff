"""The editor: a study and changes of its entries give a study.

Every answer, command and advice that changes a study does it here. A change of a
contributor, or of all parts of a name, is one of these:

- a text: another tolerance; the rest follows by the rule of
  `tolstat.study.distribution_entry`;
- a table: the entry as a whole; a batch stays one;
- a table with `nominal` alone: another size of a link, with the same deviation;
- a table with `shift` alone: parts of another mean, with the same tolerance;
  "+=0.02 mm" moves the nominal and its tolerance;
- a `NominalShift`.

Parts that shared the entry and do not change keep it. A batch changes as a whole.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from tolstat.deviations.names import expand, general
from tolstat.errors import CostError, DependenceError
from tolstat.model.description import Contributor
from tolstat.study.distribution_entry import (
    KEYS,
    REMEDY_KEYS,
    Change,
    Entry,
    NominalShift,
    distribution_of,
    is_shift,
    keys_of,
    shortest,
    with_shift,
    with_tolerance,
)
from tolstat.study.nominal_size import DeviationReader
from tolstat.study.settings_section import NOMINAL, link_tables, with_link
from tolstat.toml import toml_text

Entries = Mapping[str, Entry]


@dataclass(frozen=True)
class StudyChange:
    """A change of a study, in its own words: what `fresh_study` takes."""

    deviations: Entries = field(default_factory=dict)  # as of [deviations]: see above
    limits: Entries = field(default_factory=dict)  # a text keeps the demanded yield
    settings: Mapping[str, Any] = field(default_factory=dict)


class WrittenEntry(NamedTuple):
    """An entry of [links] or [deviations], or none yet."""

    section: str
    name: str
    keys: dict[str, Any]  # of a link also its nominal value
    members: Sequence[str]  # contributors

    def splits(self, members: Collection[str]) -> bool:
        """Return whether it is a batch of which these are some parts only."""
        return bool(self.keys.get("common")) and not {*self.members} <= {*members}


class StudyEditor:
    """Changes the table of a study, which stays valid or is refused when it is read.

    Parameters
    ----------
    table : mapping
        The study, as its file has it.
    contributors : sequence of Contributor
        Of its model with these settings.
    columns : collection of str
        Keys of a link that are no part of its deviation.
    """

    def __init__(
        self,
        table: Mapping[str, Any],
        contributors: Sequence[Contributor],
        columns: Collection[str] = (NOMINAL,),
    ) -> None:
        self.table = dict(table)
        self.parts = {part.name: part for part in contributors}
        self.columns = columns

    @property
    def text(self) -> str:
        """The study as TOML."""
        return toml_text(self.table)

    @property
    def links(self) -> dict[str, dict[str, Any]]:
        """The links as tables."""
        return link_tables(self.table.get("links", {}))

    def entries(self) -> Iterator[WrittenEntry]:
        """Yield the entries with a deviation, of [links] first."""
        for name, keys in self.links.items():
            if keys.keys() - {*self.columns}:  # else it may deviate in [deviations]
                yield WrittenEntry("links", name, keys, [name])
        for name, entry in self.table.get("deviations", {}).items():
            members = expand(name, [*self.parts])
            yield WrittenEntry("deviations", name, keys_of(entry), members)

    def entries_of(
        self, members: Sequence[str], *, nominal: bool = False
    ) -> dict[str, WrittenEntry]:
        """Return the entries of contributors, by contributor.

        With `nominal` those that have their nominal values, else their deviations.
        """
        entries = () if nominal else self.entries()
        written = {member: entry for entry in entries for member in entry.members}
        links = self.links
        for member in members:
            if member not in written:
                section = "links" if member in links else "deviations"
                keys = links.get(member, {})
                written[member] = WrittenEntry(section, member, keys, [member])
        return written

    def is_size(self, name: str, change: Change) -> bool:
        """Return whether a change is another nominal value of a link, and no more."""
        alone = isinstance(change, Mapping) and {*change} == {NOMINAL}
        links = self.links
        return alone and name in {*links, *map(general, links)}

    def changed(self, name: str, change: Change) -> dict[str, WrittenEntry]:
        """Return the entries of the parts of a name as changed, by contributor.

        Nothing is edited.

        Raises
        ------
        ModelError, DistributionError, GradeError, UnitError
            If no part has that name, or a new tolerance cannot be read or fit.
        """
        nominal = self.is_size(name, change)
        changed = dict[str, WrittenEntry]()
        members = expand(name, [*self.parts])
        entries = self.entries_of(members, nominal=nominal)
        for member in members:
            entry = entries[member]
            keys = self._keys(entry.keys, change, self.parts[member])
            changed[member] = entry._replace(keys=keys)
        return changed

    def scenario(self, name: str, change: Entry) -> dict[str, Entry]:
        """Return entries of [deviations] that a change amounts to, without batches."""
        if not (isinstance(change, str) or is_shift(change)):
            return {name: change}
        entries = {
            member: shortest({k: x for k, x in entry.keys.items() if k in KEYS})
            for member, entry in self.changed(name, change).items()
        }
        return together(name, entries)

    def change(self, name: str, change: Change) -> None:
        """Change the entries of all parts of a name; see `changed`.

        Raises
        ------
        DependenceError
            If some parts of a batch would change alone.
        """
        changed, deviations = self.changed(name, change), dict[str, Entry]()
        for member, entry in changed.items():
            if entry.splits(changed):
                batch = f"`{entry.name} = ...`"
                raise DependenceError(
                    f"a batch is one entry; give all of its parts, {batch}"
                )
            if entry.section == "links":
                self.table["links"] = with_link(self.table["links"], member, entry.keys)
            else:
                deviations[member] = shortest(entry.keys)
        if deviations:
            self._replace("deviations", name, deviations, [*self.parts])

    def limit(self, name: str, limit: Entry, responses: Sequence[str]) -> None:
        """Change the limit of responses; a text alone keeps the demanded yield."""
        before = self.table.get("limits", {})
        new = dict.fromkeys(expand(name, responses), limit)
        for other, entry in before.items():
            if isinstance(entry, Mapping) and isinstance(limit, str):
                demanding = {**entry, "limit": limit}
                new |= {n: demanding for n in expand(other, responses) if n in new}
        self._replace("limits", name, new, responses)

    def _replace(
        self, section: str, name: str, new: Mapping[str, Entry], names: Sequence[str]
    ) -> None:
        """Replace entries in their place; other parts of a group keep the old one."""
        complete = {*new} == {*expand(name, names)}  # others may stand in [links]
        entries = together(name, new) if complete else dict(new)
        replaced = dict[str, Any]()
        for other, entry in self.table.get(section, {}).items():
            members = expand(other, names)
            others = [member for member in members if member not in new]
            if others == [*members]:
                replaced[other] = entry
            else:
                replaced |= entries | dict.fromkeys(others, entry)
        self.table[section] = replaced | entries

    def _keys(
        self, keys: Mapping[str, Any], change: Change, part: Contributor
    ) -> dict[str, Any]:
        """Return the changed keys of the entry of a contributor."""
        if isinstance(change, NominalShift):
            return {**keys, "nominal_shift": change.typed}
        if isinstance(change, str):
            new = with_tolerance(keys, change, part)
            if "cost" in new and not _has_price(new, part):
                del new["cost"]
            return new
        if is_shift(change):
            return with_shift(keys, str(change["shift"]), part)
        if change.keys() <= {*self.columns}:
            return {**keys, **change}
        staying = {"common", *REMEDY_KEYS, *self.columns}
        stay = {k: x for k, x in keys.items() if k in staying}
        return {**stay, **change}


def together(name: str, entries: Mapping[str, Entry]) -> dict[str, Entry]:
    """Return equal entries of all parts of a name as one, and others as they are."""
    first, *others = entries.values()
    if all(entry == first for entry in others):
        return {name: first}
    return dict(entries)


def _has_price(keys: Mapping[str, Any], part: Contributor) -> bool:
    """Return whether the cost of an entry has a price for its tolerance."""
    from tolstat.study.cost_entry import read_costs  # for `allocate`

    rest, reader = {k: x for k, x in keys.items() if k in KEYS}, DeviationReader(part)
    specified = {part.name: distribution_of(keys, part)}
    with suppress(CostError):
        read_costs(part.name, keys["cost"], rest, {part.name: reader}, specified)
        return True
    return False
