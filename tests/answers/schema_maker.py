"""The JSON Schema of a typed answer, made from its type hints."""

from __future__ import annotations

import re
import types
from collections.abc import Mapping, Sequence
from dataclasses import is_dataclass
from enum import Enum
from pathlib import Path
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

from tolstat.document.inline import Typed
from tolstat.render.serialize import SCHEMA, public_fields
from tolstat.units.scale import Scale

NUMBER = {"anyOf": [{"type": "number"}, {"enum": ["inf", "-inf", None]}]}
SCALE = {"unit": {"type": "string"}, "shown": {"type": "string"}}
SIMPLE = {
    str: "string", Path: "string", Typed: "string", int: "integer", bool: "boolean",
}  # fmt: skip


def schema_of(answer: type, name: str) -> dict[str, Any]:
    """Return the JSON Schema of an answer.

    Parameters
    ----------
    answer : type
        A dataclass.
    name : str
        Which answer it is.
    """
    shared: dict[str, Any] = {"number": NUMBER}
    found = _record(answer, shared)
    own = {"schema": {"const": SCHEMA}, "answer": {"const": name}}
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": f"tolstat: {name}",
        **found,
        "properties": {**own, **found["properties"]},
        "required": [*own, *found["required"]],
        "$defs": shared,
    }


def _schema(hint: Any, shared: dict[str, Any]) -> dict[str, Any]:
    """Return the schema of a type; that of a record is put among the shared ones."""
    origin, given = get_origin(hint), get_args(hint)
    if hint in SIMPLE:
        return {"type": SIMPLE[hint]}
    if hint is float:
        return {"$ref": "#/$defs/number"}
    if hint is type(None):
        return {"type": "null"}
    if hint in (Any, object):
        return {}
    if isinstance(hint, type) and issubclass(hint, Enum):
        return {"enum": [member.value for member in hint]}
    if origin in (Union, types.UnionType):
        return {"anyOf": [_schema(each, shared) for each in given]}
    if origin is Literal:
        return {"enum": list(given)}
    if origin is tuple and given[-1] is not ...:
        items = [_schema(each, shared) for each in given]
        return {"type": "array", "prefixItems": items}
    if isinstance(origin, type) and issubclass(origin, Mapping):
        return {"type": "object", "additionalProperties": _schema(given[1], shared)}
    if isinstance(origin, type) and issubclass(origin, Sequence):
        return {"type": "array", "items": _schema(given[0], shared)}
    name = re.sub(r"\B(?=[A-Z])", "_", hint.__name__).lower()
    if name not in shared:
        shared[name] = {}  # its place, before those that it consists of
        shared[name] |= _record(hint, shared)
    return {"$ref": f"#/$defs/{name}"}


def _record(hint: Any, shared: dict[str, Any]) -> dict[str, Any]:
    """Return the schema of a dataclass or a NamedTuple, and the first line on it."""
    if hint is Scale:
        properties: dict[str, Any] = SCALE
    else:
        names = public_fields(hint) if is_dataclass(hint) else list(hint._fields)
        hints = get_type_hints(hint)
        properties = {name: _schema(hints[name], shared) for name in names}
    return {
        "description": str(hint.__doc__).partition("\n")[0],
        "type": "object",
        "properties": properties,
        "required": list(properties),
        "additionalProperties": False,
    }
