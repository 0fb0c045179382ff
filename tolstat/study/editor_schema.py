"""A JSON Schema of study files, for editors that complete and check TOML."""

from collections.abc import Iterable
from typing import Any

from tolstat.deviations.distributions import DISTRIBUTIONS
from tolstat.deviations.draw import SAMPLERS
from tolstat.deviations.names import known_or_general
from tolstat.model import settings as model_settings
from tolstat.model.checked import described
from tolstat.model.contract import Model
from tolstat.model.setting_kinds import Boolean, Kind, Number, Numbers, Rows, Word
from tolstat.study.distribution_entry import KEYS
from tolstat.study.sampling import GIVEN
from tolstat.study.study_schema import Document, Exponential, LimitEntry, PartsEntry

Schema = dict[str, Any]


def editor_schema(models: Iterable[Model]) -> Schema:
    """Return a JSON Schema (draft 2020-12) of the studies of some models.

    Names of settings are those of the model. Names of contributors and responses are
    offered as they are with default settings; others are allowed.
    """
    schema = Document.model_json_schema(by_alias=True)
    keys = schema["properties"]
    models = list(models)
    keys["model"]["examples"] = [model.name for model in models]
    keys["sampling"] = {
        "anyOf": [{"enum": [*SAMPLERS, *GIVEN]}, {"type": "object"}],
        "description": keys["sampling"]["description"],
    }
    for name, entry in (("deviations", _deviation()), ("links", _deviation())):
        keys[name]["additionalProperties"] = entry
    keys["limits"]["additionalProperties"] = _limit()
    chosen = [
        {"if": {"properties": {"model": {"const": model.name}}}, "then": _by(model)}
        for model in models
    ]
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema"}
    return {**head, **schema, "title": "a study of tolstat", "allOf": chosen}


def _by(model: Model) -> Schema:
    """Return the part of the schema that depends on a model."""
    contributors, responses = described(model, model_settings.make(model))
    declared = model_settings.settings_of(model)
    settings = {
        name: _setting(setting.kind) | {"description": setting.sentence}
        for name, setting in declared.items()
    }
    return {
        "properties": {
            "settings": {"properties": settings, "additionalProperties": False},
            "deviations": {"properties": _offered(contributors, _deviation())},
            "limits": {"properties": _offered(responses, _limit())},
        }
    }


def _offered(declared: Iterable[Any], entry: Schema) -> Schema:
    """Return entries by name, also without their numbers."""
    words = {column.name: column.sentence for column in declared}
    names = known_or_general(words)
    return {n: entry | {"description": words.get(n, f"all of {n}")} for n in names}


def _setting(kind: Kind) -> Schema:
    match kind:
        case Word(choices):
            return {"enum": list(choices)}
        case Boolean():
            return {"type": "boolean"}
        case Numbers(number):
            item = _setting(number)
            return {"anyOf": [item, {"type": "array", "items": item}]}
        case Number(unit="") as number if not number.presets:
            return {"type": "integer" if number.whole else "number"}
        case Number(unit=unit):
            return {"type": ["number", "string"] if unit in ("", "1") else "string"}
        case Rows(named=named):
            return {"type": "object" if named else "array"}
    return {"type": ["string", "number"]}


def _deviation() -> Schema:
    of_parts = PartsEntry.model_json_schema(by_alias=True)["properties"]
    keys: Schema = {name: {} for name in (*KEYS, "common")} | of_parts
    keys["distribution"] = {"enum": list(DISTRIBUTIONS)}
    law = Exponential.model_json_schema()["properties"]
    offers = {"type": "number", "minimum": 0}
    keys["cost"] = {
        "type": "object", "properties": law, "additionalProperties": offers,
    }  # fmt: skip
    table = {"type": "object", "properties": keys}
    return {"anyOf": [{"type": ["string", "number"]}, table]}


def _limit() -> Schema:
    return {"anyOf": [{"type": "string"}, LimitEntry.model_json_schema(by_alias=True)]}
