"""The sections [settings] and [links] of a study, and what the model makes of them.

A link is a setting of the model, its size, and a deviation.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from tolstat.errors import ModelError
from tolstat.model.checked import described
from tolstat.model.contract import Model
from tolstat.model.description import Contributor, Description
from tolstat.model.setting_kinds import Number, Rows
from tolstat.model.settings import Setting, make, setting_of, settings_of
from tolstat.study.link_entry import NOMINAL, link_tables, typed_link
from tolstat.study.problems import Problems
from tolstat.study.study_schema import DECISIVE, Document

SETTING = "links"  # of a model: a table by name with the column `nominal`


def read_settings(
    document: Document, model: Model, problems: Problems
) -> tuple[Any, Document]:
    """Return the settings, links among them, and the study with links as deviations."""
    links, values = document.links, dict[str, Any]()
    for name, value in document.settings.items():
        with problems.noting(f"[settings] {name}", value):
            setting = setting_of(model, name)
            try:
                values[name] = setting.kind.read(value)
            except ModelError as error:
                raise ModelError(f"{error} ({setting.sentence})") from None
    if links:
        sizes, document = _read_links(document, model, problems)
        values |= sizes
    try:
        return make(model, values), document
    except ModelError as error:
        if not problems.noted_in(*DECISIVE):  # else names left out may be missed
            size = links.get(error.link, {}).get(NOMINAL)
            if isinstance(size, int | float):
                unit = f'write its unit, such as {NOMINAL} = "{size} mm"'
                key, link = f"[links] {error.link}", typed_link(links[error.link])
                problems.add(key, link, f"the size has no unit; {unit}")
            else:
                problems.add("[settings]", None, str(error))
        raise problems.refusal from None


def _read_links(
    document: Document, model: Model, problems: Problems
) -> tuple[dict[str, Any], Document]:
    """Return the setting of all links that can be read, and the study.

    It has each link as a setting and a deviation.
    """
    columns = link_columns(model)
    with problems.noting("[links]", None):
        if NOMINAL not in columns:
            raise ModelError(f"model '{model.name}' has no links; use [deviations]")
        if SETTING in document.settings:
            raise ModelError("[settings] links exists too; give links once")
    if problems.noted("[links]"):
        return {}, document
    kind = settings_of(model)[SETTING].kind
    sizes, deviations = dict[str, Any](), dict[str, Any]()
    for name, keys in document.links.items():
        link = typed_link(keys)
        with problems.noting(key := f"[links] {name}", link):
            if NOMINAL not in keys:
                example = 'such as nominal = "60 mm"'
                raise ModelError(f"the key {NOMINAL} is missing, {example}")
            if name in document.deviations:
                twice = "also given in [deviations]; give its tolerance here only, as "
                problems.add(key, link, f"{twice}{{ nominal = ..., tolerance = ... }}")
            if deviates := {k: x for k, x in keys.items() if k not in columns}:
                deviations[name] = deviates
            sizes |= kind.read({name: {k: x for k, x in keys.items() if k in columns}})
    settings = settings_with_links(document.model_dump(), model)
    both = {**deviations, **document.deviations}
    changed = {"settings": settings, "deviations": both}
    return {SETTING: sizes}, document.model_copy(update=changed)


def settings_with_links(table: Mapping[str, Any], model: Model) -> dict[str, Any]:
    """Return the settings of a study, including its links."""
    settings = dict(table.get("settings", {}))
    if links := table.get("links"):
        columns = link_columns(model)
        settings[SETTING] = {
            name: {k: x for k, x in keys.items() if k in columns}
            for name, keys in link_tables(links).items()
        }
    return settings


def link_columns(model: Model) -> tuple[str, ...]:
    """Return the keys of a link beside its deviation; empty without links."""
    declared = settings_of(model).get(SETTING)
    if declared is None or not isinstance(declared.kind, Rows):
        return ()
    return tuple(declared.kind.columns)


def described_with_sizes(model: Model, settings: Any) -> Description:
    """Return contributors and responses; a setting of the same name is the size."""
    description, declared = described(model, settings), settings_of(model)
    return description._replace(contributors=tuple(
        replace(part, size=_size_of(part, declared.get(part.name), settings))
        for part in description.contributors
    ))  # fmt: skip


def _size_of(
    contributor: Contributor, setting: Setting | None, settings: Any
) -> float | None:
    """Return the nominal value of a contributor, SI; None where none is known."""
    if contributor.size is not None or setting is None:
        return contributor.size
    unit = setting.kind.unit if isinstance(setting.kind, Number) else None
    if contributor.unit == "1" and contributor.shown != "1":  # relative to the setting
        return None
    value = getattr(settings, contributor.name)
    same = (unit or "1") == contributor.unit and isinstance(value, int | float)
    return float(value) if same else None
