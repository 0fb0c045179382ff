"""Problems of entries that show without the model: keys, tolerances, limits."""

import re
from collections.abc import Iterator
from contextlib import suppress
from typing import Any

from tolstat.deviations.iso286 import looks_like_grade
from tolstat.errors import TolstatError, UnitError
from tolstat.model.contract import Model
from tolstat.model.description import Contributor
from tolstat.study.distribution_entry import read_distribution
from tolstat.study.entry_change import keys_of
from tolstat.study.limits_section import read_limit
from tolstat.study.links_section import NOMINAL, keys_of_link, link_columns
from tolstat.study.nominal_size import DeviationReader
from tolstat.study.problems import Problems
from tolstat.study.study_schema import Document
from tolstat.units.conversion import dimension, si_unit

# what depends on names, sizes or files of the study
DEPENDENT = ("size", "common", "cost", "nominal_shift", "iso1328", "module")


def note_readable(document: Document, model: Model | None, problems: Problems) -> None:
    """Note what is wrong in deviations and limits whatever the model's names are.

    For a study whose model or settings are wrong: an entry is read in the unit that it
    is written in. What needs the model is left for the next time.
    """
    for section, name, keys in _tolerances(document, model):
        key = f"[{section}] {name}"
        if problems.noted(key):
            continue
        with problems.noting(key, keys):
            written = str(keys.get("tolerance", keys.get("value", "")))
            plain = Contributor(name, _unit(written), shown="1")
            read_distribution(keys, DeviationReader(plain))
    for name, entry in document.limits.items():
        text = entry if isinstance(entry, str) else str(entry.get("limit", ""))
        with problems.noting(f"[limits] {name}", entry):
            unit = _unit(text)
            read_limit(entry, unit, unit)  # in which it is shown, the model knows


def _tolerances(
    document: Document, model: Model | None
) -> Iterator[tuple[str, str, dict[str, Any]]]:
    """Yield deviations that need no size: section, name, keys."""
    columns = {NOMINAL}
    with suppress(TolstatError, AttributeError):
        columns |= {*link_columns(model)} if model else set()
    for section in ("links", "deviations"):
        for name, entry in getattr(document, section).items():
            keys = keys_of_link(entry) if section == "links" else keys_of(entry)
            keys = {k: x for k, x in keys.items() if k not in {*columns, *DEPENDENT}}
            zone = str(keys.get("tolerance", ""))
            shares = any("%" in str(value) for value in keys.values())
            of_a_size = shares or (zone and looks_like_grade(zone))
            if keys and "data" not in keys and not of_a_size:
                yield section, name, keys


def _unit(text: str) -> str:
    """Return the SI unit at the end of a text; that of a number where it has none."""
    written = re.search(r"[^\W\d_][^\s.]*$", text.strip())
    with suppress(UnitError):
        return si_unit(dimension(written[0] if written else "1"))
    return "1"
