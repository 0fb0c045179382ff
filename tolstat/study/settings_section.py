"""The sections [settings] and [links] of a study, and what the model makes of them.

A link is a setting of the model, its size, and a deviation. It is typed as a table, as
a quantity, or as a drawing has it, see `drawing_text`. A fit, "30 H7/g6 mm", is two
links. Once a study is checked all its links are tables.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from tolstat.deviations.grades import looks_like_grade
from tolstat.errors import DistributionError, ModelError
from tolstat.model.checked import described
from tolstat.model.contract import Model
from tolstat.model.description import Contributor, Description
from tolstat.model.setting_kinds import Number, Rows
from tolstat.model.settings import Setting, make, setting_of, settings_of
from tolstat.study.distribution_entry import keys_of, shortest
from tolstat.study.drawing_text import of_link, separated
from tolstat.study.problems import Problems, toml_of
from tolstat.study.study_schema import DECISIVE, TABLES, Document
from tolstat.units.grammar import refuse_two_signs

SETTING = "links"  # of a model: a table by name with the column `nominal`
NOMINAL, TOLERANCE = "nominal", "tolerance"
SIZED = NOMINAL, TOLERANCE, "mean", "sigma"
OF_A_FIT = "hole", "shaft"


def read_settings(
    document: Document, model: Model, problems: Problems
) -> tuple[Any, Document]:
    """Return the settings, links among them, and the study with links as deviations."""
    links: Mapping[str, Any] = document.links
    values = dict[str, Any]()
    for name, value in document.settings.items():
        with problems.noting(f"[settings] {name}", value):
            setting = setting_of(model, name)
            try:
                values[name] = setting.kind.read(value)
            except ModelError as error:
                raise ModelError(f"{error} ({setting.sentence})") from None
    for section in TABLES:
        if table := getattr(document, section):
            with problems.noting(f"[{section}]", None):
                if section not in settings_of(model):
                    raise ModelError(f"model '{model.name}' has no {section}")
                if section in document.settings:
                    raise ModelError(f"[settings] {section} exists too; give one")
                values[section] = settings_of(model)[section].kind.read(table)
    if links:
        sizes, document = _read_links(document, model, problems)
        values |= sizes
    try:
        settings = settings_with_links(document.model_dump(), model)
        document = document.model_copy(update={"settings": settings})
        return make(model, values), document
    except ModelError as error:
        if not problems.noted_in(*DECISIVE):  # else names left out may be missed
            size = links.get(error.link, {}).get(NOMINAL)
            if isinstance(size, int | float):
                unit = f'write its unit, such as {NOMINAL} = "{size} mm"'
                key, link = f"[links] {error.link}", typed_link(links[error.link])
                problems.add(key, link, f"the size has no unit; {unit}")
            else:
                section = error.section or ("gaps" if document.gaps else "settings")
                problems.add(f"[{section}]", None, str(error))
        raise problems.refusal from None


def _read_links(
    document: Document, model: Model, problems: Problems
) -> tuple[dict[str, Any], Document]:
    """Return the setting of all links that can be read, and the study.

    It has the tolerance of each link as a deviation.
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
    for name, keys in link_tables(document.links).items():
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
    both = {**deviations, **document.deviations}
    return {SETTING: sizes}, document.model_copy(update={"deviations": both})


def settings_with_links(table: Mapping[str, Any], model: Model) -> dict[str, Any]:
    """Return the settings of a study, including its links and other tables."""
    tables = {name: table[name] for name in TABLES if table.get(name)}
    settings = {**table.get("settings", {}), **tables}
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


def with_link_tables(document: Document, problems: Problems) -> Document:
    """Return a study with its links as tables, and no deviations that have a size.

    Problems are noted of links that cannot be read and of deviations with a size.
    """
    links, deviations = dict[str, Any](), dict[str, Any]()
    for name, link in document.links.items():
        with problems.noting(f"[links] {name}", link):
            links |= tables_of(name, link, document.links)
    for name, entry in document.deviations.items():
        with problems.noting(f"[deviations] {name}", entry):
            keys = keys_of(entry)
            zone = keys.get(TOLERANCE)
            if both := separated(zone) if isinstance(zone, str) else None:
                right = toml_of(shortest(keys | {TOLERANCE: both[1]}))
                raise DistributionError(f"a deviation has no size; write {right}")
            deviations[name] = entry
    return document.model_copy(update={"links": links, "deviations": deviations})


def link_tables(links: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Return the links of a study as tables, by name; a fit is two.

    Raises
    ------
    ModelError, UnitError
        If a text cannot be read, or a link is given twice.
    """
    tables = dict[str, dict[str, Any]]()
    for name, link in links.items():
        tables |= tables_of(name, link, links)
    return tables


def tables_of(
    name: str, link: Any, links: Mapping[str, Any]
) -> dict[str, dict[str, Any]]:
    """Return one of the links of a study as a table, or the two of a fit, by name."""
    keys = dict(link) if isinstance(link, Mapping) else {NOMINAL: link}
    nominal = keys.get(NOMINAL)
    refuse_two_signs(*(x for k, x in keys.items() if k in SIZED and isinstance(x, str)))
    if isinstance(nominal, str):
        typed = dict(zip((NOMINAL, TOLERANCE), of_link(nominal), strict=False))
        if TOLERANCE in typed and TOLERANCE in keys:
            raise ModelError(f"{NOMINAL} holds a tolerance, too; give one of them")
        keys = typed | {k: x for k, x in keys.items() if k != NOMINAL}
    zone = keys.get(TOLERANCE)
    if not isinstance(zone, str):
        return {name: keys}
    if both := separated(zone):
        right = toml_of({**keys, TOLERANCE: both[1]})
        raise ModelError(f"a tolerance has no size; write {right}")
    hole, slash, shaft = (part.strip() for part in zone.partition("/"))
    if not (slash and looks_like_grade(hole)):
        return {name: keys}
    if not (hole[:1].isupper() and shaft[:1].islower()):
        raise ModelError(f"'{zone}': a fit is a hole and a shaft, such as H7/g6")
    names = [f"{name}_{part}" for part in OF_A_FIT]
    if twice := [part for part in names if part in links]:
        raise ModelError(
            f"a fit is two links, {' and '.join(names)}; {twice[0]} is given twice"
        )
    return {
        part: {**keys, TOLERANCE: grade}
        for part, grade in zip(names, (hole, shaft), strict=True)
    }


def typed_link(keys: Mapping[str, Any]) -> Any:
    """Return a link as a person types it: a nominal value alone is no table."""
    return keys[NOMINAL] if keys.keys() == {NOMINAL} else dict(keys)


def with_link(
    links: Mapping[str, Any], name: str, keys: Mapping[str, Any]
) -> dict[str, Any]:
    """Return the links of a study, one of them with other keys.

    Other links stay as they are written. A fit of which one part changes is two links.
    """
    changed = dict[str, Any]()
    for other, link in links.items():
        tables = tables_of(other, link, links)
        changed |= tables | {name: keys} if name in tables else {other: link}
    return changed
