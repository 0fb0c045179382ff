"""Slips in a study, and what to write instead, beyond what its readers refuse.

Keys at the top that belong in a section, and problems that show without the model.
"""

import re
from collections.abc import Mapping
from contextlib import suppress
from typing import Any

from tolstat import catalogue
from tolstat.deviations.grades import looks_like_grade
from tolstat.deviations.names import expand
from tolstat.errors import TolstatError, UnitError
from tolstat.model.checked import described
from tolstat.model.contract import Model
from tolstat.model.description import Contributor
from tolstat.model.setting_kinds import Text
from tolstat.model.settings import read, settings_of
from tolstat.study.deviations_section import MEAN_WITHIN
from tolstat.study.distribution_entry import REMEDY_KEYS, keys_of, read_distribution
from tolstat.study.limits_section import read_limit
from tolstat.study.nominal_size import DeviationReader
from tolstat.study.problems import Problems
from tolstat.study.settings_section import NOMINAL, link_columns, settings_with_links
from tolstat.study.study_schema import Document
from tolstat.units.conversion import dimension, si_unit

QUANTITIES = ("tolerance", "value", "mean", "sigma")  # in the unit of the part
# what depends on names, sizes or files of the study
DEPENDENT = (
    "size", "common", MEAN_WITHIN, "cost", "nominal_shift", "iso1328", "module",
    *REMEDY_KEYS,
)  # fmt: skip


def section_of(
    name: str, value: Any, table: Mapping[str, Any], model: Model | None
) -> str:
    """Return the section where a key of a study belongs; empty if in none.

    A name of several kinds is what its value can be.
    """
    setting = None
    with suppress(TolstatError, AttributeError, TypeError):
        model = model or catalogue.find(str(table.get("model")))
        setting = settings_of(model).get(name)
        if setting and not isinstance(setting.kind, Text):
            with suppress(TolstatError):
                setting.kind.read(value)
                return "settings"
        if name in table.get("links", {}):
            return "links"
        settings = read(model, settings_with_links(table, model))
        contributors, responses = described(model, settings)
        with suppress(TolstatError):
            if expand(name, [part.name for part in contributors]):
                return "deviations"
        with suppress(TolstatError):
            by_name = {response.name: response for response in responses}
            response = by_name[expand(name, [*by_name])[0]]
            if not setting or read_limit(value, response.unit, response.shown):
                return "limits"
    return "settings" if setting else ""


def note_readable(document: Document, model: Model | None, problems: Problems) -> None:
    """Note what is wrong in deviations and limits whatever the model's names are.

    For a study whose model or settings are wrong: an entry is read in the unit that it
    is written in. What needs the model is left for the next time.
    """
    columns = {NOMINAL}
    with suppress(TolstatError, AttributeError):
        columns |= {*link_columns(model)} if model else set()
    for section, read_keys in (("links", dict), ("deviations", keys_of)):
        for name, entry in getattr(document, section).items():
            keys = {
                k: value
                for k, value in read_keys(entry).items()
                if k not in {*columns, *DEPENDENT}
            }
            zone, key = str(keys.get("tolerance", "")), f"[{section}] {name}"
            shares = any("%" in str(value) for value in keys.values())
            of_a_size = shares or (zone and looks_like_grade(zone))
            if not keys or "data" in keys or of_a_size or problems.noted(key):
                continue
            with problems.noting(key, keys):
                texts = (keys[key] for key in QUANTITIES if key in keys)
                unit = _unit(str(next(texts, "")))
                reader = DeviationReader(Contributor(name, unit, shown="1"))
                read_distribution(keys, reader)
    for name, entry in document.limits.items():
        text = entry if isinstance(entry, str) else str(entry.get("limit", ""))
        with problems.noting(f"[limits] {name}", entry):
            unit = _unit(text)
            read_limit(entry, unit, unit)  # in which it is shown, the model knows


def _unit(text: str) -> str:
    """Return the SI unit at the end of a text; that of a number where it has none."""
    word = r"[^\W\d_][^\s.]*"
    written = re.search(rf"(?:{word}\s+)*{word}$", text.strip())
    words = written[0].split() if written else []
    for first in range(len(words)):  # "N m" before "m"
        with suppress(UnitError):
            return si_unit(dimension(" ".join(words[first:])))
    return "1"
