"""Entries of a study with half their tolerance."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from tolstat.deviations.distributions import Tolerance
from tolstat.deviations.names import expand
from tolstat.execution.diagnostics.halved_tolerances import is_turn
from tolstat.model.description import Contributor
from tolstat.store.stored_run import Run
from tolstat.study.nominal_size import DeviationReader
from tolstat.units.scale import KNOWN, Scale, figures

PLACES = ("plateau", "mode", "median", "shift")  # keys that are places in the zone
NOT_KEPT = ("tolerance", "size", "iso1328", "module", "nominal", "common", "cost")


def halved_entries(run: Run, parts: Sequence[str]) -> dict[str, Any]:
    """Return entries of [deviations] that halve the tolerances of parts, by name.

    Each deviation halves as in `tolstat.deviations.spread.halved`: its distance from
    zero, or from the nearer end of a tolerance on one side of zero. All parts of an
    entry that halve stand together. A full turn stays. Empty if one of the parts has no
    tolerance, as measured ones.
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
        new = {n: _halved(entry, zones[n], readers[n], run.scales[n]) for n in halve}
        one = next(iter(new.values()))
        same = every and all(each == one for each in new.values())
        found |= {name: one} if same else new
    return found


def entries_of(run: Run) -> Iterator[tuple[str, dict[str, Any], Sequence[str]]]:
    """Yield the entries of [links] and [deviations]: name, keys, contributors."""
    table, every = run.study.table, [each.name for each in run.contributors]
    for name, given in (table.get("links", {}) | table.get("deviations", {})).items():
        keys = {"tolerance": given} if isinstance(given, str) else dict(given)
        yield name, keys, expand(name, every)


def nominal_shift(entry: Mapping[str, Any], part: Contributor) -> float:
    """Return the `nominal_shift` of an entry of [deviations] or [links], SI."""
    found = entry.get("nominal_shift")
    return DeviationReader(part).deviation(str(found)) if found else 0.0


def _halved(
    entry: Mapping[str, Any], zone: Tolerance, reader: DeviationReader, scale: Scale
) -> Any:
    """Return an entry with half its tolerance, and what depends on that."""
    zone = Tolerance(*(end - nominal_shift(entry, reader.contributor) for end in zone))
    half = Tolerance(*(zone.nearest + 0.5 * (end - zone.nearest) for end in zone))
    kept = {k: v for k, v in entry.items() if k not in NOT_KEPT}
    new = {"tolerance": _typed(half, scale), **moved(kept, zone, half, reader, scale)}
    return new if len(new) > 1 else new["tolerance"]


def moved(
    entry: Mapping[str, Any],
    old: Tolerance,
    new: Tolerance,
    reader: DeviationReader,
    scale: Scale,
) -> dict[str, Any]:
    """Return keys of an entry with their places in a zone, in another zone.

    Mode, median and plateau lie as far across the new zone as across the old one; the
    shift of a mean grows and shrinks with the zone. Other keys stay.
    """
    ratio = new.half / old.half

    def place(x: float) -> float:
        return new.middle + ratio * (x - old.middle)

    found = dict(entry)
    for key in entry.keys() & {*PLACES}:
        if key == "plateau":
            ends = [*map(place, reader.zone(entry[key]))]
        elif key == "shift":
            ends = [ratio * reader.difference(str(entry[key]))]
        else:
            ends = [place(reader.deviation(str(entry[key])))]
        found[key] = _typed(ends, scale)
    return found


def narrowest(
    entry: Mapping[str, Any], zone: Tolerance, reader: DeviationReader
) -> float:
    """Return how narrow a tolerance may be, over its width, with its keys unchanged.

    The zone, SI, is that of a run, its nominal shift included.
    """
    zone = Tolerance(*(end - nominal_shift(entry, reader.contributor) for end in zone))
    fixed, reach = zone.nearest, [0.0]
    for key in entry.keys() & {*PLACES}:
        if key == "shift":
            reach.append(abs(reader.difference(str(entry[key]))) / zone.half)
            continue
        ends = (
            reader.zone(entry[key])
            if key == "plateau"
            else [reader.deviation(str(entry[key]))]
        )
        for x in ends:
            end = zone.upper if x > fixed else zone.lower
            # no narrower zone has a place on the other side of the end that stays
            reach.append((x - fixed) / (end - fixed) if end != fixed else 0.0)
    return max(reach)


def _typed(ends: Sequence[float], scale: Scale) -> str:
    """Return a quantity, or a zone, as it is typed."""
    words = [figures(scale.factor * end, KNOWN) for end in ends]
    if words[0] == f"-{words[-1]}":
        words = [f"+-{words[1]}"]
    return f"{'..'.join(words)} {scale.mark}".strip()
