"""Entries of a study with half their tolerance."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from tolstat.deviations.distributions import Distribution, Tolerance
from tolstat.deviations.names import expand
from tolstat.deviations.spread import (
    PLACES,
    fixed_point,
    in_zone,
    unshifted,
    zone_of,
)
from tolstat.execution.diagnostics.halved_tolerances import is_turn
from tolstat.model.description import Contributor
from tolstat.store.stored_run import Run
from tolstat.study.distribution_entry import read_distribution
from tolstat.study.nominal_size import DeviationReader
from tolstat.study.typed_zone import typed, typed_places
from tolstat.units.scale import Scale

MOVED = (*PLACES, "shift")  # keys that change with the zone
NO_DISTRIBUTION = ("nominal", "common", "cost")  # keys that say nothing of it
NOT_KEPT = ("tolerance", "size", "iso1328", "module", *NO_DISTRIBUTION)


def halved_entries(run: Run, parts: Sequence[str]) -> dict[str, Any]:
    """Return entries of [deviations] that halve the tolerances of parts, by name.

    Each deviation halves as in `tolstat.deviations.spread.halved`. All parts of an
    entry that halve stand together. A full turn stays. Empty if one of the parts has
    no tolerance, as measured ones.
    """
    readers = {each.name: DeviationReader(each) for each in run.contributors}
    found = dict[str, Any]()
    for name, entry, own in entries_of(run):
        members = [n for n in own if n in parts]
        zones = {n: Tolerance(*run.assumed[n].tolerance) for n in members}
        halve = [n for n in members if not is_turn(run.units[n], zones[n])]
        if not halve:
            continue
        if "tolerance" not in entry and "iso1328" not in entry:
            return {}
        every = entry.get("common") or set(members) == {*own}
        new = {n: _halved(entry, readers[n], run.scales[n]) for n in halve}
        one = next(iter(new.values()))
        same = every and all(each == one for each in new.values())
        found |= {name: one} if same else new
    return found


def entries_of(run: Run) -> Iterator[tuple[str, dict[str, Any], Sequence[str]]]:
    """Yield the entries of [links] and [deviations]: name, keys, contributors."""
    table, every = run.study.table, [each.name for each in run.contributors]
    links = {  # a text alone is the nominal value of a link that may deviate elsewhere
        name: link for name, link in table.get("links", {}).items()
        if isinstance(link, Mapping) and {*link} != {"nominal"}
    }  # fmt: skip
    for name, given in (links | table.get("deviations", {})).items():
        keys = {"tolerance": given} if isinstance(given, str) else dict(given)
        yield name, keys, expand(name, every)


def nominal_shift(entry: Mapping[str, Any], part: Contributor) -> float:
    """Return the `nominal_shift` of an entry of [deviations] or [links], SI."""
    found = entry.get("nominal_shift")
    return DeviationReader(part).deviation(str(found)) if found else 0.0


def fixed_points(run: Run) -> dict[str, float]:
    """Return the deviation, SI, about which the zone of contributors narrows, by name.

    That of measured parts, which have no tolerance, is not in it.
    """
    readers = {each.name: DeviationReader(each) for each in run.contributors}
    return {
        name: fixed_point(
            _distribution(entry, readers[name]), sized=readers[name].is_sized(entry)
        )
        for _, entry, members in entries_of(run)
        if "tolerance" in entry or "iso1328" in entry
        for name in members
        if name in run.assumed  # not a link that has a size alone
    }


def _halved(entry: Mapping[str, Any], reader: DeviationReader, scale: Scale) -> Any:
    """Return an entry with half its tolerance, and what depends on that."""
    old = unshifted(_distribution(entry, reader))
    zone = zone_of(old)
    assert zone is not None  # the entry has a tolerance
    fixed = fixed_point(old, sized=reader.is_sized(entry))
    half = Tolerance(*(fixed + 0.5 * (end - fixed) for end in zone))
    kept = {k: v for k, v in entry.items() if k not in NOT_KEPT}
    new = {"tolerance": typed(half, scale), **moved(kept, old, half, scale)}
    return new if len(new) > 1 else new["tolerance"]


def _distribution(entry: Mapping[str, Any], reader: DeviationReader) -> Distribution:
    """Return the distribution of a contributor with an entry of the study of a run."""
    keys = {k: v for k, v in entry.items() if k not in NO_DISTRIBUTION}
    return read_distribution(keys, reader)


def moved(
    entry: Mapping[str, Any], old: Distribution, zone: Tolerance, scale: Scale
) -> dict[str, Any]:
    """Return keys of an entry, of a given distribution, in another zone.

    Places move as in `tolstat.deviations.spread.in_zone`. Other keys stay.
    """
    new = in_zone(old, zone)
    places = typed_places(new, scale)
    if (shift := getattr(new, "shift", None)) is not None:
        places["shift"] = typed([shift], scale)
    return {**entry, **{k: places[k] for k in entry.keys() & places.keys()}}
