"""Entries of a study as a page moves them, and the parts that they are of."""

import math
from collections.abc import Collection, Iterator, Mapping
from contextlib import suppress
from typing import Any, NamedTuple

from tolstat.answers.explore.distribution_tables import (
    OFFERED,
    Kind,
    distribution_table,
    keys_in_zone,
    offered_kind,
    tolerance_of,
)
from tolstat.deviations.density_ratio import Density
from tolstat.deviations.dependence import dependent_groups, equal_parts
from tolstat.deviations.distributions import Tolerance
from tolstat.deviations.grades import grade_zone
from tolstat.deviations.spread import fixed_point, unshifted, zone_of
from tolstat.errors import DistributionError, GradeError, TolstatError
from tolstat.model.description import Contributor
from tolstat.store.stored_run import Run
from tolstat.study.distribution_entry import KEYS, WITHOUT
from tolstat.study.editor import WrittenEntry
from tolstat.study.nominal_size import DeviationReader
from tolstat.study.study import Study
from tolstat.toml import toml_key, toml_keys
from tolstat.units.grammar import quantity
from tolstat.units.scale import KNOWN, Scale, figures

GRADES = [
    *(f"IT{number}" for number in range(5, 14)),
    *(f"{letter}{number}" for letter in ("h", "js", "H") for number in range(5, 13)),
]
# of sliders, in half widths of the drawing: of the half width, of the shift; less far
# where trials are weighted
RANGES = {True: ((0.1, 2.0), 1.0), False: ((0.2, 1.2), 0.5)}
EQUAL = 1e-6  # of half a zone: read again it is the same
ONE_ENTRY = "its batch has several entries"
A_MEAN = "its mean lies anywhere within a range"


class PageEntry(NamedTuple):
    """An entry that deviates."""

    written: WrittenEntry
    members: tuple[str, ...]  # contributors
    reason: str  # why a page does not move it; empty if it does


class PageEntries:
    """The entries of a run's study, and which of them move.

    Parameters
    ----------
    run, study
        The run, and its study.
    evaluated : bool
        Whether trials are evaluated again; else they are weighted.
    fixed_sizes : collection of str
        Links whose nominal value does not move.
    """

    def __init__(
        self,
        run: Run,
        study: Study,
        *,
        evaluated: bool,
        fixed_sizes: Collection[str] = (),
    ) -> None:
        self.run, self.study, self.evaluated = run, study, evaluated
        self.fixed_sizes = fixed_sizes
        self.distributions = study.deviating.distributions
        self.contributors = {part.name: part for part in run.contributors}
        self._without_density = {n: self._no_density(n) for n in self.distributions}
        self.entries = [*self._entries()]

    def _entries(self) -> Iterator[PageEntry]:
        for written in self.study.editor().entries():
            members = tuple(n for n in written.members if n in self.distributions)
            if members:
                reasons = filter(None, (self._reason(written, n) for n in members))
                yield PageEntry(written, members, next(reasons, ""))

    def _no_density(self, name: str) -> str:
        try:
            Density(self.distributions[name])
        except DistributionError as error:
            return str(error)
        return ""

    def _reason(self, written: WrittenEntry, name: str) -> str:
        """Return why a page does not move a contributor; empty if it does."""
        distribution, deviating = self.distributions[name], self.study.deviating
        if subjects := [x for key, x in WITHOUT.items() if key in written.keys]:
            return f"{subjects[0]} no tolerance to change"
        zone = zone_of(distribution)
        if zone is None or not zone.half > 0:
            return "it has no tolerance to change"
        if name in deviating.means:
            return A_MEAN
        equal = equal_parts(name, deviating.dependence)
        if any(deviating.entries[other] != deviating.entries[name] for other in equal):
            return ONE_ENTRY
        if not self._is_readable(name, zone):
            return "its tolerance cannot be typed here"
        if self.evaluated:
            return ""
        for group in dependent_groups([name], deviating.dependence):
            for other in group:
                if words := self._without_density[other]:
                    return words if other == name else f"it depends on {other}: {words}"
        return ""

    def _is_readable(self, name: str, zone: Tolerance) -> bool:
        """Tell whether a zone, as a page types it, is read as the same."""
        with suppress(TolstatError):
            reader = DeviationReader(self.contributors[name])
            again = reader.zone(zone_text(zone, self.run.scales[name]))
            ends = zip(zone, again, strict=True)
            return all(abs(a - b) <= EQUAL * zone.half for a, b in ends)
        return False

    @property
    def moving(self) -> dict[str, int]:
        """The contributors that move, with the place of their entry."""
        return {
            member: number
            for number, entry in enumerate(self.entries)
            if not entry.reason
            for member in entry.members
        }

    def data(self, parts: Mapping[str, int]) -> tuple[list[Any], dict[str, Any]]:
        """Return the entries, and the distributions that they offer, as data.

        `parts` are the places of contributors among those of the page.
        """
        kinds = {name: distribution_table(kind) for name, kind in OFFERED.items()}
        entries = [self._entry(entry, parts, kinds) for entry in self.entries]
        return entries, kinds

    def _entry(
        self, entry: PageEntry, parts: Mapping[str, int], kinds: dict[str, Any]
    ) -> dict[str, Any]:
        written, first = entry.written, entry.members[0]
        scale, part = self.run.scales[first], self.contributors[first]
        data: dict[str, Any] = {
            "name": written.name,
            "members": [
                parts[n] for n in filter(self._counts, entry.members) if n in parts
            ],
            "parts": len(entry.members),
            "section": written.section,
            "unit": scale.mark,
            "factor": scale.factor,
            "key": toml_key(written.name),
            "words": self.study.deviating.words[first],
            "reason": entry.reason,
            "nominal": part.size or 0.0,
            "sized": written.section == "links" and first not in self.fixed_sizes,
            "lower": 0.0,
            "upper": 0.0,
            "kind": "",
            "kinds": [],
            "grade": "",
            "grades": {},
        }
        return data if entry.reason else data | self._movable(entry, kinds)

    def _movable(self, entry: PageEntry, kinds: dict[str, Any]) -> dict[str, Any]:
        """Return the data of an entry that moves; its distribution joins the others."""
        keys, first = entry.written.keys, entry.members[0]
        distribution, part = self.distributions[first], self.contributors[first]
        zone, name = tolerance_of(distribution), offered_kind(distribution)
        if not name:
            name = f"own_{entry.written.name}"
            label = str(keys.get("distribution", "normal")).replace("_", " ")
            typed = keys_in_zone(keys, unshifted(distribution))
            kinds[name] = distribution_table(
                Kind(f"{label}, as on the drawing", typed, distribution)
            )
        offered = [
            kind
            for kind in (name, *(other for other in OFFERED if other != name))
            if self.evaluated or kinds[kind]["log_slope"]
        ]
        rest = {k: x for k, x in keys.items() if k not in KEYS and k != "nominal"}
        sized = first in self.study.deviating.sized
        grades, tolerance = grades_of(part, keys), str(keys.get("tolerance", ""))
        size, half, factor = part.size or 0.0, zone.half, self.run.scales[first].factor
        (small, large), shift = RANGES[self.evaluated]
        return {
            "tracks": {
                "nominal": track(size - 2 * half, size + 2 * half, factor),
                "half": track(small * half, large * half, factor),
                "shift": track(-shift * half, shift * half, factor),
            },
            "lower": zone.lower,
            "upper": zone.upper,
            "centre": fixed_point(distribution, sized=sized),
            "shifted": getattr(distribution, "by", 0.0),
            "kind": name,
            "kinds": offered,
            "tolerance": tolerance,
            "size": str(keys.get("size", "")),
            "rest": toml_keys(rest),
            "grade": tolerance if tolerance in grades else "",
            "grades": grades,
        }

    def _counts(self, name: str) -> bool:
        """Tell whether a part has a weight: of equal ones the first."""
        equal = equal_parts(name, self.study.deviating.dependence)
        return self.evaluated or name == equal[0]

    def groups(self, parts: Mapping[str, int]) -> list[list[str]]:
        """List the dependent groups of the parts of a page."""
        dependence = self.study.deviating.dependence
        return [g for g in dependent_groups(parts, dependence) if len(g) > 1]


def track(low: float, high: float, factor: float) -> list[float]:
    """Return ends and step of a slider, in the unit shown: round numbers.

    Without two ends, as where no trial is done, it does not move.
    """
    width = factor * (high - low)
    if not width > 0:
        return [0.0, 0.0, 1.0]
    step = 10.0 ** math.floor(math.log10(width / 100))
    ends = (round(factor * end / step) * step for end in (low, high))
    return [float(f"{x:.7g}") for x in (*ends, step)]


def zone_text(zone: Tolerance, scale: Scale) -> str:
    """Return a zone as the script of a page types it: +-0.1 mm, +0.1..+0.3 mm."""
    low, high = (figures(scale.factor * end, KNOWN) for end in zone)
    if low == f"-{high}":
        return f"+-{high} {scale.mark}".strip()
    low, high = (f"+{x}" if float(x) > 0 else x for x in (low, high))
    return f"{low}..{high} {scale.mark}".strip()


def grades_of(part: Contributor, keys: Mapping[str, Any]) -> dict[str, list[float]]:
    """Return zones, SI, of ISO grades at the size of a contributor; none without."""
    size = quantity(str(keys["size"]), "m") if "size" in keys else part.size
    zones = dict[str, list[float]]()
    if part.unit != "m" or not size:
        return zones
    for grade in GRADES:
        with suppress(GradeError):
            zones[grade] = [*grade_zone(grade, abs(size))]
    return zones
