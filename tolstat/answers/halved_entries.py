"""Half the tolerances of contributors, as changes of the entries of a study."""

from collections.abc import Collection, Mapping

from tolstat.store.assumed import is_turn
from tolstat.store.stored_run import Run
from tolstat.study.distribution_entry import typed
from tolstat.study.nominal_size import DeviationReader


def to_narrow(run: Run, parts: Collection[str]) -> list[str]:
    """Return the parts whose tolerances narrow if all do: a full turn stays.

    Empty if one of the parts has no tolerance, as measured ones.
    """
    names = [
        name
        for name, assumed in run.assumed.items()
        if name in parts and not is_turn(run.units[name], assumed.tolerance)
    ]
    return names if all(run.assumed[name].has_tolerance for name in names) else []


def halved_entries(run: Run, parts: Collection[str]) -> dict[str, str]:
    """Return half the tolerances of parts by entry, as what-if takes them.

    Each deviation halves as in `tolstat.deviations.spread.halved`. All parts of an
    entry that halve stand together. See `to_narrow` for those that do not.
    """
    entries, names = dict[str, str](), to_narrow(run, parts)
    readers = {part.name: DeviationReader(part) for part in run.contributors}
    for entry in dict.fromkeys(run.assumed[name].entry for name in names):
        members = {n: part for n, part in run.assumed.items() if part.entry == entry}
        halved = {
            name: typed(part.halved_as_typed, run.scales[name], readers[name])
            for name, part in members.items()
            if name in names
        }
        batch = any(part.common for part in members.values())
        complete, tolerances = halved.keys() == members.keys(), {*halved.values()}
        together = (batch or complete) and len(tolerances) == 1
        entries |= {entry: tolerances.pop()} if together else halved
    return entries


def common_tolerance(run: Run, entries: Mapping[str, str]) -> str:
    """Return the tolerance of all entries.

    Empty if they differ, or where a tolerance alone is no remedy: other keys have to
    change with it.
    """
    changed = (p for n, p in run.assumed.items() if {n, p.entry} & entries.keys())
    alone, tolerances = not any(p.has_places for p in changed), {*entries.values()}
    return tolerances.pop() if alone and len(tolerances) == 1 else ""
