"""The section [links] of a study: what each link is, and how it deviates."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from tolstat.deviations.distributions import Distribution
from tolstat.errors import ModelError
from tolstat.model.contract import Model
from tolstat.model.setting_kinds import Rows
from tolstat.model.settings import settings_of
from tolstat.study.distribution_entry import written_unit
from tolstat.study.problems import Problems
from tolstat.study.study_schema import Document
from tolstat.units.grammar import Measure
from tolstat.units.scale import scale_of

SETTING = "links"  # of a machine: a table by name, one of whose columns is `nominal`
NOMINAL = "nominal"


def settings_with_links(table: Mapping[str, Any], model: Model) -> dict[str, Any]:
    """Return the settings of a study, what its links are among them."""
    given = dict(table.get("settings", {}))
    if links := table.get("links"):
        columns = _columns(model)
        given[SETTING] = {
            name: {key: value for key, value in _keys(link).items() if key in columns}
            for name, link in links.items()
        }
    return given


def read_links(document: Document, model: Model, problems: Problems) -> Document:
    """Read a link as what it is: a setting, and a deviation beside it."""
    if not document.links:
        return document
    columns = _columns(model)
    with problems.noting("[links]", None):
        if NOMINAL not in columns:
            raise ModelError(f"model '{model.name}' has no links; [deviations] has")
        if SETTING in document.settings:
            raise ModelError("[settings] links says the same; give them once")
    deviations: dict[str, Any] = {}
    for name, link in document.links.items():
        with problems.noting(f"[links] {name}", link):
            if NOMINAL not in _keys(link):
                example = 'such as nominal = "60 mm"'
                raise ModelError(f"the key {NOMINAL} is missing, {example}")
            if name in document.deviations:
                raise ModelError(
                    "it stands in [deviations] as well; give its tolerance here, as "
                    "{ nominal = ..., tolerance = ... }"
                )
            if deviates := _deviation(_keys(link), columns):
                deviations[name] = deviates
    problems.raise_if_any()
    given = {"settings": document.settings, "links": document.links}
    settings = settings_with_links(given, model)
    both = {**deviations, **document.deviations}
    return document.model_copy(update={"settings": settings, "deviations": both})


def check_sizes(
    links: Mapping[str, Any],
    settings: Any,
    distributions: Mapping[str, Distribution],
    units: Mapping[str, str],
    problems: Problems,
) -> None:
    """Refuse tolerances that are sizes: they hold the nominal, and not nothing."""
    for name, link in links.items():
        zone = getattr(distributions.get(name), "tolerance", None)
        if zone is None:
            continue
        size = getattr(settings, SETTING)[name][NOMINAL]
        nominal = size.value if isinstance(size, Measure) else size
        if zone.lower <= nominal <= zone.upper and not zone.lower <= 0 <= zone.upper:
            scale = scale_of(units[name], written_unit(link))
            ends = ((end - nominal) * scale.factor for end in zone)
            written = "..".join(f"{end:.6g}" for end in ends)
            message = "a tolerance is what a link may be off its nominal, such as "
            problems.add(f"[links] {name}", link, f'{message}"{written} {scale.mark}"')


def with_deviation(
    link: Any, line: str | Mapping[str, Any], model: Model
) -> dict[str, Any]:
    """Return a link as it is, with another deviation."""
    columns = _columns(model)
    own = {key: value for key, value in _keys(link).items() if key in columns}
    return own | ({"tolerance": line} if isinstance(line, str) else dict(line))


def _columns(model: Model) -> tuple[str, ...]:
    """Return what a link has besides its deviation; nothing where there are none."""
    declared = settings_of(model).get(SETTING)
    if declared is None or not isinstance(declared.kind, Rows):
        return ()
    return tuple(declared.kind.columns)


def _keys(link: Any) -> Mapping[str, Any]:
    """Return the keys of a link; a quantity alone is its nominal."""
    return link if isinstance(link, Mapping) else {NOMINAL: link}


def _deviation(link: Mapping[str, Any], columns: tuple[str, ...]) -> dict[str, Any]:
    """Return what a link says of its deviation; empty for one that has none."""
    found = {key: value for key, value in link.items() if key not in columns}
    if "data" in found:  # measured sizes are taken off their nominal
        found[NOMINAL] = link[NOMINAL]
    return found
