"""Entries of a study with half their tolerance."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from tolstat.deviations.distributions import Tolerance
from tolstat.deviations.names import expand
from tolstat.execution.diagnostics.halved_tolerances import is_turn
from tolstat.store.stored_run import Run
from tolstat.units import grammar
from tolstat.units.scale import KNOWN, Scale, figures

NOT_KEPT = ("tolerance", "size", "iso1328", "module", "nominal", "common", "cost")


def halved_entries(run: Run, parts: Sequence[str]) -> dict[str, Any]:
    """Return entries of [deviations] that halve the tolerances of parts, by name.

    Each deviation halves as in `tolstat.deviations.spread.halved`: its distance from
    zero, or from the nearer end of a tolerance on one side of zero. All parts of an
    entry that halve stand together. A full turn stays. Empty if one of the parts has no
    tolerance, as measured ones.
    """
    units = {each.name: each.unit for each in run.contributors}
    found = dict[str, Any]()
    for name, entry, own in entries_of(run):
        members = [n for n in own if n in parts]
        zones = {n: Tolerance(*run.assumed[n].tolerance) for n in members}
        halve = [n for n in members if not is_turn(units[n], zones[n])]
        if not halve:
            continue
        if "tolerance" not in entry and "iso1328" not in entry:
            return {}
        every = entry.get("common") or set(members) == {*own}
        new = {n: _halved(entry, zones[n], units[n], run.scales[n]) for n in halve}
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


def nominal_shift(entry: Mapping[str, Any], unit: str) -> float:
    """Return the `nominal_shift` of an entry of [deviations] or [links], SI."""
    found = entry.get("nominal_shift")
    return grammar.quantity(str(found), unit) if found else 0.0


def _halved(entry: Mapping[str, Any], zone: Tolerance, unit: str, scale: Scale) -> Any:
    """Return an entry with half its tolerance, and what depends on that."""
    zone = Tolerance(*(end - nominal_shift(entry, unit) for end in zone))

    def typed(ends: Sequence[float], centre: float = zone.nearest) -> str:
        half = [scale.factor * (centre + 0.5 * (end - centre)) for end in ends]
        words = [figures(end, KNOWN) for end in half]
        if words[0] == f"-{words[-1]}":
            words = [f"+-{words[1]}"]
        return f"{'..'.join(words)} {scale.mark}".strip()

    new: dict[str, Any] = {"tolerance": typed(zone)}
    for key, value in entry.items():
        if key == "shift":
            new[key] = typed([grammar.quantity(value, unit)], 0.0)
        elif key in ("mode", "median"):
            new[key] = typed([grammar.quantity(value, unit)])
        elif key == "plateau":
            new[key] = typed(grammar.tolerance(value, unit))
        elif key not in NOT_KEPT:
            new[key] = value
    return new if len(new) > 1 else new["tolerance"]
