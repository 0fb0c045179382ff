"""Keys at the top of a study that belong in one of its sections."""

from collections.abc import Mapping
from contextlib import suppress
from typing import Any

from tolstat import catalogue
from tolstat.deviations.names import expand
from tolstat.errors import TolstatError
from tolstat.model.checked import described
from tolstat.model.contract import Model
from tolstat.model.setting_kinds import Text
from tolstat.model.settings import read, settings_of
from tolstat.study.limits_section import read_limit
from tolstat.study.links_section import settings_with_links


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
