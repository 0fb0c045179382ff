"""A JSON Schema of study files, for editors that complete and check TOML."""

from collections.abc import Iterable
from typing import Any

from tolstat.deviations.distributions import DISTRIBUTIONS
from tolstat.deviations.draw import SAMPLERS
from tolstat.deviations.names import known_or_general
from tolstat.model import settings as model_settings
from tolstat.model.checked import described
from tolstat.model.contract import Model
from tolstat.study.deviations_section import MEAN_WITHIN
from tolstat.study.distribution_entry import FIXED, KEYS, STEP
from tolstat.study.sampling import GIVEN
from tolstat.study.study_schema import Document, Exponential, LimitEntry, PartsEntry

Schema = dict[str, Any]
_KEYS: Schema = {
    **{key: {} for key in (*KEYS, "common", MEAN_WITHIN, STEP)},
    FIXED: {"type": "boolean"},
    **PartsEntry.model_json_schema(by_alias=True)["properties"],
    "distribution": {"enum": list(DISTRIBUTIONS)},
    "cost": {
        "type": "object",
        "properties": Exponential.model_json_schema()["properties"],
        "additionalProperties": {"type": "number", "minimum": 0},
    },
}
_TABLE: Schema = {"type": "object", "properties": _KEYS}
_DEVIATION: Schema = {"anyOf": [{"type": ["string", "number"]}, _TABLE]}
_LIMIT: Schema = {
    "anyOf": [{"type": "string"}, LimitEntry.model_json_schema(by_alias=True)]
}


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
    for name in ("deviations", "links"):
        keys[name]["additionalProperties"] = _DEVIATION
    keys["limits"]["additionalProperties"] = _LIMIT
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
        name: setting.kind.schema | {"description": setting.sentence}
        for name, setting in declared.items()
    }
    return {
        "properties": {
            "settings": {"properties": settings, "additionalProperties": False},
            "deviations": {"properties": _offered(contributors, _DEVIATION)},
            "limits": {"properties": _offered(responses, _LIMIT)},
        }
    }


def _offered(declared: Iterable[Any], entry: Schema) -> Schema:
    """Return entries by name, also without their numbers."""
    words = {column.name: column.sentence for column in declared}
    names = known_or_general(words)
    return {n: entry | {"description": words.get(n, f"all of {n}")} for n in names}
