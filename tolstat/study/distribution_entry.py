"""One entry of [deviations], read; and with another tolerance, and what moves with it.

The rule of every other tolerance, whoever asks for it:

- `mode`, `median`, `plateau`, `mean`, and the `shift` of a mean, move with the zone:
  they lie as far across the new one as across the old one; `sigma` is in proportion to
  it, so that Cp stays. See `tolstat.deviations.spread.in_zone`.
- `distribution`, `cp`, `cpk`, `nominal_shift`, `common` and all other keys stay.
- `size` stays for a grade alone. The tolerance replaces `iso1328` and `module`.
- `cost` stays where it has a price for the new tolerance, and else goes: see
  `tolstat.study.editor`.

Parts without a tolerance, measured or constant, have none to change.
"""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple, cast

import numpy as np

from tolstat.deviations.distributions import (
    DISTRIBUTIONS,
    Distribution,
    Normal,
    Source,
    Tolerance,
)
from tolstat.deviations.grades import (
    general_class,
    general_zone,
    grade_zone,
    looks_like_grade,
)
from tolstat.deviations.spread import (
    PLACES,
    WIDTHS,
    Shifted,
    in_zone,
    unshifted,
    zone_of,
)
from tolstat.errors import DistributionError, GradeError, allowed_names
from tolstat.model.description import Contributor
from tolstat.study.nominal_size import DeviationReader
from tolstat.units.grammar import MOST_NUMBER, quantity, unit_of
from tolstat.units.scale import KNOWN, Scale, figures, scale_of

DEFAULT = "normal"
# the least and the largest possible unit sample, and the middle
OUTERMOST = np.array([2.0**-53, 0.5, 1 - 2.0**-53])
QUANTITIES: dict[str, Callable[[DeviationReader, str], Any]] = {
    "quantity": DeviationReader.deviation,
    "difference": DeviationReader.difference,
    "mean": DeviationReader.mean,
    "tolerance": DeviationReader.zone,
}
_FIELDS_OF = {
    name: {field.name for field in dataclasses.fields(cast(Any, kind))}
    for name, kind in DISTRIBUTIONS.items()
}
OF_THE_TOLERANCE = ("tolerance", "size", "iso1328", "module", "nominal_shift")
# all keys of an entry that its distribution depends on
KEYS = dict.fromkeys(
    [*OF_THE_TOLERANCE, "distribution", *(n for x in _FIELDS_OF.values() for n in x)]
)
FIXED, STEP = "fixed", "step"
REMEDY_KEYS = (FIXED, STEP)  # keys for remedies: see `tolstat.study.remedy_keys`
MOVED = (*PLACES, *WIDTHS, "mean")  # keys that change with the zone
# by their keys: deviations without a tolerance that could change
WITHOUT = {
    "data": "measured parts have", "value": "a constant has", "parts": "a mixture has",
}  # fmt: skip
WITH_UNIT = ("tolerance", "value", "sigma")  # in whose unit a deviation is written
SOURCES = 'such as { share = "70 %", mean = "10 mm", sigma = "0.02 mm" }'
EXAMPLE = '{ tolerance = "+-0.1 mm" }'

Entry = str | dict[str, Any]


class NominalShift(NamedTuple):
    """A shift of the nominal of all parts of an entry, with their tolerance."""

    typed: str  # as the key `nominal_shift`


Change = Entry | NominalShift


def read_distribution(entry: dict[str, Any], reader: DeviationReader) -> Distribution:
    """Return the distribution of one contributor's deviation.

    From `tolerance` ("+-1.2 mm", "IT7" with or without `size`), or `iso1328` and
    `module`; `nominal_shift`; `distribution`, and the keys of that distribution. SI.
    """
    keys = dict(entry)
    shift = keys.pop("nominal_shift", None)
    name = keys.pop("distribution", DEFAULT)
    if name not in list(DISTRIBUTIONS):  # it may be no text
        allowed = allowed_names(str(name), DISTRIBUTIONS)
        raise DistributionError(f"no distribution is called '{name}'; {allowed}")
    kind: Any = DISTRIBUTIONS[name]
    fields = {field.name: field for field in dataclasses.fields(kind)}
    values: dict[str, Any] = {}
    zone = typed_tolerance(keys, reader)
    if zone is None and "sigma" in keys and "sigma" in fields:
        zone = _around(keys, fields, reader)
    if zone is not None:
        if "tolerance" not in fields:
            raise DistributionError(f"the {name} distribution has no tolerance")
        values["tolerance"] = zone
    for key, value in keys.items():
        if key not in fields:
            others = [f for f in fields if f != "tolerance"]
            allowed = allowed_names(key, ["distribution", *OF_THE_TOLERANCE, *others])
            raise DistributionError(
                f"the {name} distribution has no key {key}; {allowed}"
            )
        values[key] = _value(key, value, fields[key].metadata, reader)
    for key, field in fields.items():
        if key in values or field.default is not dataclasses.MISSING:
            continue
        if key == "tolerance":
            raise DistributionError('the key tolerance is missing; such as "+-1.2 mm"')
        words = field.metadata["choices"]
        hint = f": {' or '.join(words)}" if words else ""
        raise DistributionError(f"the {name} distribution needs the key {key}{hint}")
    distribution: Distribution = kind(**values)
    if not _computable(distribution):
        words = ", ".join(f"{k} {v}" for k, v in entry.items() if k != "distribution")
        raise DistributionError(
            f"the {name} distribution with {words} cannot be computed: it is too wide "
            "or too skewed"
        )
    if shift is None:
        return distribution
    if zone is None:
        raise DistributionError("nominal_shift moves a tolerance; add one to the entry")
    return Shifted(distribution, reader.deviation(str(shift)))


def _around(
    keys: Mapping[str, Any], fields: Mapping[str, Any], reader: DeviationReader
) -> Tolerance:
    """Return three sigma to either side of the mean of an entry without tolerance."""
    if wrong := [key for key in ("cp", "cpk", "shift") if key in keys]:
        raise DistributionError(f"{wrong[0]} refers to a tolerance; add one")
    mean, sigma = (
        _value(key, keys[key], fields[key].metadata, reader) if key in keys else 0.0
        for key in ("mean", "sigma")
    )
    return Tolerance(mean - 3 * sigma, mean + 3 * sigma)


def _computable(distribution: Distribution) -> bool:
    """Tell whether its middle and its outermost deviations are numbers."""
    with np.errstate(all="ignore"):
        try:
            ends = distribution.deviations(OUTERMOST)
        except OverflowError:
            return False
    return bool(np.all(np.abs(ends) <= MOST_NUMBER))  # NaN is not


def written_unit(keys: Mapping[str, Any], reader: DeviationReader) -> str:
    """Return the unit in which a deviation is written; empty for a grade."""
    text = next((str(keys[key]) for key in WITH_UNIT if key in keys), "")
    graded = not text or looks_like_grade(text)
    return "" if graded else reader.shown_unit(unit_of(text))


def _value(key: str, value: Any, declared: Any, reader: DeviationReader) -> Any:
    """Read the value of one key as its distribution declares it."""
    if declared["reads"] == "parts":
        return _sources(value, reader)
    if read := QUANTITIES.get(declared["reads"]):
        return read(reader, str(value))
    if declared["reads"] == "word":
        if value not in declared["choices"]:
            allowed = allowed_names(str(value), declared["choices"])
            raise DistributionError(f"{key} = '{value}': {allowed}")
        return value
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise DistributionError(f"{key}: a number is expected")
    return float(value)


def _sources(parts: Any, reader: DeviationReader) -> tuple[Source, ...]:
    """Return share, mean and sigma of each part of a mixture."""
    if not isinstance(parts, Sequence) or not all(isinstance(x, dict) for x in parts):
        raise DistributionError(f"parts: a list of tables is expected, {SOURCES}")
    sources = []
    for part in parts:
        share = part.get("share")
        if not isinstance(share, str):
            raise DistributionError(f"parts: each needs its share, {SOURCES}")
        normal = {key: x for key, x in part.items() if key != "share"}
        distribution = read_distribution(normal, reader)
        if type(distribution) is not Normal:
            raise DistributionError(f"parts: each is normal, {SOURCES}")
        sources.append(Source(quantity(share, "1"), *distribution.mean_and_sigma))
    return tuple(sources)


def typed_tolerance(keys: dict[str, Any], reader: DeviationReader) -> Tolerance | None:
    """Return the tolerance and remove its keys: limits, a grade or a class of gears."""
    contributor = reader.contributor
    text, size = keys.pop("tolerance", None), keys.pop("size", None)
    flank_class, module = keys.pop("iso1328", None), keys.pop("module", None)
    if flank_class is not None or module is not None:
        if text is not None:
            raise GradeError("tolerance and iso1328 say the same thing; give one")
        return _class_of_gears(flank_class, module, contributor)
    if text is None:
        return None
    if not isinstance(text, str):
        raise DistributionError('tolerance: a text such as "+-1.2 mm" is expected')
    if not looks_like_grade(text):
        if size is not None:
            raise GradeError("size belongs to a grade such as IT7; leave it out")
        return reader.zone(text)
    general = general_class(text) is not None
    if contributor.unit != "m" and not (general and contributor.unit == "rad"):
        shown = scale_of(contributor.unit, contributor.shown).shown
        kind = "a plain number; give its unit" if shown == "1" else f"given in {shown}"
        raise GradeError(
            f"{text} is of lengths{' and angles' if general else ''}; "
            f"{contributor.name} is {kind}"
        )
    if contributor.unit == "rad":
        if size is None:
            raise GradeError(
                f"{text} of an angle is by the length of its shorter side; give it, "
                f'such as {{ tolerance = "{text}", size = "50 mm" }}'
            )
        return general_zone(text, quantity(str(size), "m"), "rad")
    nominal = reader.size if size is None else reader.size_of_grade(str(size))
    if not nominal:
        raise GradeError(
            f"{text}: {contributor.name} has no nominal size; give it, such as "
            f'{{ tolerance = "{text}", size = "350 mm" }}'
        )
    return (general_zone if general else grade_zone)(text, abs(nominal))


def _class_of_gears(
    flank_class: Any, module: Any, contributor: Contributor
) -> Tolerance:
    from tolstat.deviations.gear_classes import ISO_1328, gear_zone  # seldom used

    if contributor.gear is None:
        raise GradeError(
            f"{ISO_1328} is for the run-out and the pitch of gears; "
            f"{contributor.name} is neither"
        )
    if isinstance(flank_class, bool) or not isinstance(flank_class, int):
        raise GradeError(
            f"iso1328 is a class from 1 to 11 ({ISO_1328}), such as iso1328 = 7"
        )
    if module is None:
        raise GradeError(
            f"class {flank_class} of {ISO_1328} needs the normal module, such "
            'as module = "12 mm"'
        )
    diameter, error = contributor.gear
    return gear_zone(error, diameter, quantity(str(module), "m"), flank_class)


def keys_of(entry: Entry) -> dict[str, Any]:
    """Return the keys of an entry of [deviations]; a text alone is its tolerance."""
    return {"tolerance": entry} if isinstance(entry, str) else dict(entry)


def shortest(keys: dict[str, Any]) -> Entry:
    """Return an entry as a person writes it: a tolerance alone is a text."""
    return keys["tolerance"] if keys.keys() == {"tolerance"} else keys


def distribution_of(keys: Mapping[str, Any], part: Contributor) -> Distribution:
    """Return the distribution of a contributor by an entry of a study that was read."""
    shape = {key: value for key, value in keys.items() if key in KEYS}
    return read_distribution(shape, DeviationReader(part))


def with_tolerance(
    keys: Mapping[str, Any], tolerance: str, part: Contributor
) -> dict[str, Any]:
    """Return the keys of an entry with another tolerance, by the rule of this file.

    Raises
    ------
    DistributionError
        If the entry has no tolerance to change.
    """
    if wrong := [subject for key, subject in WITHOUT.items() if key in keys]:
        subject = wrong[0]
        raise DistributionError(
            f"{subject} no tolerance to change; give a whole entry, such as {EXAMPLE}"
        )
    obsolete = {"module"} if looks_like_grade(tolerance) else {"module", "size"}
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


def is_shift(change: Any) -> bool:
    """Return whether a change of an entry is another shift, and no more."""
    return isinstance(change, Mapping) and {*change} == {"shift"}


def with_shift(
    keys: Mapping[str, Any], shift: str, part: Contributor
) -> dict[str, Any]:
    """Return the keys of an entry with another shift.

    "+=" and "-=" move the nominal with its tolerance, from where it is. So does the
    shift of a distribution that has no key of this name.

    Raises
    ------
    DistributionError
        If the entry has no tolerance to shift.
    """
    reader = DeviationReader(part)
    fields = _FIELDS_OF[keys.get("distribution", DEFAULT)]
    if wrong := [subject for key, subject in WITHOUT.items() if key in keys]:
        raise DistributionError(f"{wrong[0]} no tolerance to shift")
    if zone_of(distribution_of(keys, part)) is None:
        raise DistributionError("it has no tolerance to shift; give a whole entry")
    adds = shift[:2] in ("+=", "-=")
    text = shift[2:].strip() if adds else shift
    by = reader.difference(text)
    key = "shift" if not adds and "shift" in fields else "nominal_shift"
    if adds:
        before = reader.difference(str(keys[key])) if key in keys else 0.0
        by = before - by if shift[0] == "-" else before + by
    unit = reader.shown_unit(unit_of(text))
    return {**keys, key: typed(by, scale_of(part.unit, unit), reader)}


def typed(ends: float | Sequence[float], scale: Scale, reader: DeviationReader) -> str:
    """Return a deviation, or a zone, SI, as a study types it: read again it is same."""
    values = ends if isinstance(ends, Sequence) else (ends,)
    plus = "+" if reader.needs_sign(values) else ""
    words = [figures(scale.factor * value, KNOWN) for value in values]
    if len(values) == 2 and words[0] == f"-{words[1]}":
        return f"+-{words[1]} {scale.mark}".strip()
    signed = [f"{plus}{x}" if v > 0 else x for x, v in zip(words, values, strict=True)]
    return f"{'..'.join(signed)} {scale.mark}".strip()
