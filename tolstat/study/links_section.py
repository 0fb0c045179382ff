"""The section [links] of a study: links with their sizes and deviations."""

from collections.abc import Mapping
from typing import Any

from tolstat.errors import ModelError, TolstatError
from tolstat.model.contract import Model
from tolstat.model.setting_kinds import Rows
from tolstat.model.settings import settings_of
from tolstat.study.problems import Problems
from tolstat.study.study_schema import Document

SETTING = "links"  # of a model: a table by name with the column `nominal`
NOMINAL = "nominal"


def settings_with_links(table: Mapping[str, Any], model: Model) -> dict[str, Any]:
    """Return the settings of a study, including its links."""
    settings = dict(table.get("settings", {}))
    if links := table.get("links"):
        columns = link_columns(model)
        settings[SETTING] = {
            name: {
                key: value
                for key, value in keys_of_link(link).items()
                if key in columns
            }
            for name, link in links.items()
        }
    return settings


def read_links(document: Document, model: Model, problems: Problems) -> Document:
    """Return a study with each link as a setting and a deviation."""
    if not document.links:
        return document
    columns = link_columns(model)
    with problems.noting("[links]", None):
        if NOMINAL not in columns:
            raise ModelError(f"model '{model.name}' has no links; use [deviations]")
        if SETTING in document.settings:
            raise ModelError("[settings] links exists too; give links once")
    if problems.noted("[links]"):
        return document
    deviations, sized = dict[str, Any](), dict[str, Any]()
    for name, link in document.links.items():
        with problems.noting(f"[links] {name}", link):
            if NOMINAL not in keys_of_link(link):
                example = 'such as nominal = "60 mm"'
                raise ModelError(f"the key {NOMINAL} is missing, {example}")
            sized[name] = link
            if name in document.deviations:
                raise ModelError(
                    "also given in [deviations]; give its tolerance here only, as "
                    "{ nominal = ..., tolerance = ... }"
                )
            if deviates := {
                key: value
                for key, value in keys_of_link(link).items()
                if key not in columns
            }:
                deviations[name] = deviates
    table = {"settings": document.settings, "links": sized}
    settings = settings_with_links(table, model)
    both = {**deviations, **document.deviations}
    return document.model_copy(update={"settings": settings, "deviations": both})


def read_sizes(
    sizes: Mapping[str, Any], links: Mapping[str, Any], model: Model, problems: Problems
) -> dict[str, Any]:
    """Return the links whose sizes can be read, as a setting."""
    readable = dict[str, Any]()
    kind = settings_of(model)[SETTING].kind
    for name, size in sizes.items():
        with problems.noting(f"[links] {name}", links[name]):
            readable |= kind.read({name: size})
    return readable


def check_units(
    links: Mapping[str, Any], error: TolstatError, problems: Problems
) -> None:
    """Note links without a unit that an error of the model names."""
    for name, link in links.items():
        number = keys_of_link(link)[NOMINAL]
        if isinstance(number, int | float) and f"'{name}'" in str(error):
            example = f'write its unit, such as {NOMINAL} = "{number} mm"'
            problems.add(f"[links] {name}", link, f"the size has no unit; {example}")


def link_columns(model: Model) -> tuple[str, ...]:
    """Return the keys of a link beside its deviation; empty without links."""
    declared = settings_of(model).get(SETTING)
    if declared is None or not isinstance(declared.kind, Rows):
        return ()
    return tuple(declared.kind.columns)


def keys_of_link(link: Any) -> dict[str, Any]:
    """Return the keys of a link; a quantity alone is its nominal."""
    return dict(link) if isinstance(link, Mapping) else {NOMINAL: link}
