"""Changes of one entry of a study: another tolerance, and what moves with it.

The rule of every other tolerance, whoever asks for it:

- `mode`, `median` and `plateau`, and the `shift` of a mean, move with the zone: they
  lie as far across the new one as across the old one, see
  `tolstat.deviations.spread.in_zone`.
- `distribution`, `cp`, `cpk`, `nominal_shift`, `common` and all other keys stay.
- `size` stays for a grade alone. The tolerance replaces `iso1328` and `module`.
- `cost` stays where it has a price for the new tolerance, and else goes: see
  `tolstat.study.editor`.

Parts without a tolerance, measured or constant, have none to change.
"""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from tolstat.deviations import iso286
from tolstat.deviations.distributions import Distribution
from tolstat.deviations.spread import PLACES, in_zone, unshifted, zone_of
from tolstat.errors import DistributionError
from tolstat.model.description import Contributor
from tolstat.study.distribution_entry import KEYS, read_distribution
from tolstat.study.nominal_size import DeviationReader
from tolstat.units.grammar import unit_of
from tolstat.units.scale import KNOWN, Scale, figures, scale_of

MOVED = (*PLACES, "shift")  # keys that change with the zone
EXAMPLE = '{ tolerance = "+-0.1 mm" }'

Entry = str | dict[str, Any]


class NominalShift(NamedTuple):
    """A shift of the nominal of all parts of an entry, with their tolerance."""

    typed: str  # as the key `nominal_shift`


Change = Entry | NominalShift


def keys_of(entry: Entry) -> dict[str, Any]:
    """Return the keys of an entry of [deviations]; a text alone is its tolerance."""
    return {"tolerance": entry} if isinstance(entry, str) else dict(entry)


def shortest(keys: dict[str, Any]) -> Entry:
    """Return an entry as a person writes it: a tolerance alone is a text."""
    return keys["tolerance"] if keys.keys() == {"tolerance"} else keys


def has_tolerance(keys: Mapping[str, Any]) -> bool:
    """Return whether an entry has a tolerance, and not a grade of another name."""
    return "tolerance" in keys or "iso1328" in keys


def distribution_of(keys: Mapping[str, Any], part: Contributor) -> Distribution:
    """Return the distribution of a contributor by an entry of a study that was read."""
    return read_distribution(
        {key: value for key, value in keys.items() if key in KEYS},
        DeviationReader(part),
    )


def with_tolerance(
    keys: Mapping[str, Any], tolerance: str, part: Contributor
) -> dict[str, Any]:
    """Return the keys of an entry with another tolerance, by the rule of this file.

    Raises
    ------
    DistributionError
        If the entry has no tolerance to change.
    """
    if "data" in keys or "value" in keys:
        subject = "measured parts have" if "data" in keys else "a constant has"
        raise DistributionError(
            f"{subject} no tolerance to change; give a whole entry, such as {EXAMPLE}"
        )
    obsolete = {"module"} if iso286.looks_like_grade(tolerance) else {"module", "size"}
    new = {
        "tolerance" if key == "iso1328" else key: value
        for key, value in keys.items()
        if key not in obsolete
    } | {"tolerance": tolerance}
    zone = {key: x for key, x in new.items() if key in ("tolerance", "size")}
    ends = zone_of(distribution_of(zone, part))
    assert ends is not None  # of a normal distribution
    if moved := [key for key in MOVED if key in keys]:
        distribution = in_zone(unshifted(distribution_of(keys, part)), ends)
        for key in moved:
            value, reader = getattr(distribution, key), DeviationReader(part)
            unit = reader.shown_unit(unit_of(str(keys[key])))
            new[key] = typed(value, scale_of(part.unit, unit), reader)
    return new


def typed(ends: float | Sequence[float], scale: Scale, reader: DeviationReader) -> str:
    """Return a deviation, or a zone, SI, as a study types it: read again it is same."""
    values = ends if isinstance(ends, Sequence) else (ends,)
    plus = "+" if reader.needs_sign(values) else ""
    words = [figures(scale.factor * value, KNOWN) for value in values]
    if len(values) == 2 and words[0] == f"-{words[1]}":
        return f"+-{words[1]} {scale.mark}".strip()
    signed = [f"{plus}{x}" if v > 0 else x for x, v in zip(words, values, strict=True)]
    return f"{'..'.join(signed)} {scale.mark}".strip()
