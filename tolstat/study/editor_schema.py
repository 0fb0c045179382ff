"""A JSON Schema of study files, for editors that complete and check TOML."""

from collections.abc import Iterable
from dataclasses import fields
from typing import Any

from tolstat.deviations.distributions import DISTRIBUTIONS
from tolstat.deviations.draw import SAMPLERS
from tolstat.deviations.names import known_or_general
from tolstat.model import settings as model_settings
from tolstat.model.checked import described
from tolstat.model.contract import Model
from tolstat.model.setting_kinds import Boolean, Kind, Number, Numbers, Rows, Word
from tolstat.study.distribution_entry import OF_THE_TOLERANCE
from tolstat.study.sampling import GIVEN
from tolstat.study.study_schema import Document, Exponential, LimitEntry, PartsEntry

Schema = dict[str, Any]


def editor_schema(models: Iterable[Model]) -> Schema:
    """Return a JSON Schema (draft 2020-12) of the studies of some models.

    Names of settings are those of the model. Names of contributors and responses are
    offered as they are with default settings; others are allowed.
    """
    found = Document.model_json_schema(by_alias=True)
    keys = found["properties"]
    known = list(models)
    keys["model"]["examples"] = [model.name for model in known]
    keys["sampling"] = {
        "anyOf": [{"enum": [*SAMPLERS, *GIVEN]}, {"type": "object"}],
        "description": keys["sampling"]["description"],
    }
    for name, entry in (("deviations", _deviation()), ("links", _deviation())):
        keys[name]["additionalProperties"] = entry
    keys["limits"]["additionalProperties"] = _limit()
    chosen = [
        {"if": {"properties": {"model": {"const": each.name}}}, "then": _of(each)}
        for each in known
    ]
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema"}
    return {**head, **found, "title": "a study of tolstat", "allOf": chosen}


def _of(model: Model) -> Schema:
    """Return the part of the schema that depends on a model."""
    contributors, responses = described(model, model_settings.make(model))
    declared = model_settings.settings_of(model)
    settings = {
        name: _setting(each.kind) | {"description": each.sentence}
        for name, each in declared.items()
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
    words = {each.name: each.sentence for each in declared}
    names = known_or_general(words)
    return {n: entry | {"description": words.get(n, f"all of {n}")} for n in names}


def _setting(kind: Kind) -> Schema:
    match kind:
        case Word(choices):
            return {"enum": list(choices)}
        case Boolean():
            return {"type": "boolean"}
        case Numbers(each):
            one = _setting(each)
            return {"anyOf": [one, {"type": "array", "items": one}]}
        case Number(unit="") as number if not number.presets:
            return {"type": "integer" if number.whole else "number"}
        case Number(unit=unit):
            return {"type": ["number", "string"] if unit in ("", "1") else "string"}
        case Rows(named=named):
            return {"type": "object" if named else "array"}
    return {"type": ["string", "number"]}


def _deviation() -> Schema:
    keys: Schema = {
        field.name: {}
        for kind in DISTRIBUTIONS.values()
        for field in fields(kind)  # type: ignore[arg-type]  # each is a dataclass
    }
    of_parts = PartsEntry.model_json_schema(by_alias=True)["properties"]
    every = {name: {} for name in (*OF_THE_TOLERANCE, "common")} | keys | of_parts
    every["distribution"] = {"enum": list(DISTRIBUTIONS)}
    law = Exponential.model_json_schema()["properties"]
    offers = {"type": "number", "minimum": 0}
    every["cost"] = {
        "type": "object", "properties": law, "additionalProperties": offers,
    }  # fmt: skip
    table = {"type": "object", "properties": every}
    return {"anyOf": [{"type": ["string", "number"]}, table]}


def _limit() -> Schema:
    return {"anyOf": [{"type": "string"}, LimitEntry.model_json_schema(by_alias=True)]}
