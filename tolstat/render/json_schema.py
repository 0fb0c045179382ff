"""Typed answers as JSON, and the JSON Schema of each, made from its type hints."""

from __future__ import annotations

import json
import math
import re
import types
from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from pathlib import Path
from sys import float_info
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

import numpy as np

from tolstat.units.scale import Scale

SCHEMA = 1  # raised when a name or a meaning changes
NUMBER = {"anyOf": [{"type": "number"}, {"enum": ["inf", "-inf", None]}]}
SCALE = {"unit": {"type": "string"}, "shown": {"type": "string"}}
SIMPLE = {str: "string", Path: "string", int: "integer", bool: "boolean"}


def as_json(answer: Any, name: str) -> str:
    """Write a typed answer as JSON, SI.

    Parameters
    ----------
    answer : dataclass
        Its fields are the names of the schema.
    name : str
        Which answer it is.

    Returns
    -------
    str
        An estimate is value, lower, upper (its 95 % interval) and reason; what is not
        known is null, and what is infinite "inf" or "-inf".
    """
    found = {"schema": SCHEMA, "answer": name, **_plain(answer)}
    return json.dumps(found, indent=1, allow_nan=False) + "\n"


def share_words(share: float) -> str:
    """Name a typed share: 0.00135 is "0.135 %", and nothing but 1 "100 %"."""
    return f"{100 * share:.{float_info.dig}g} %"


def _plain(found: Any) -> Any:
    if isinstance(found, Scale):
        return {"unit": found.unit, "shown": found.shown}
    if is_dataclass(found) and not isinstance(found, type):
        return {name: _plain(getattr(found, name)) for name in _public(type(found))}
    if hasattr(found, "_asdict"):
        return {name: _plain(value) for name, value in found._asdict().items()}
    if isinstance(found, Mapping):
        return {_key(key): _plain(value) for key, value in found.items()}
    if isinstance(found, Sequence) and not isinstance(found, str):
        return [_plain(value) for value in found]
    if isinstance(found, np.generic):
        found = found.item()
    if isinstance(found, float) and not math.isfinite(found):
        return None if math.isnan(found) else "inf" if found > 0 else "-inf"
    return str(found) if isinstance(found, Path) else found


def _key(key: object) -> str:
    """Name a key: a quantile by its share, several contributors by their names."""
    if isinstance(key, float):
        return share_words(key)
    return ", ".join(key) if isinstance(key, tuple) else str(key)


def _public(record: Any) -> list[str]:
    """List the fields of a dataclass that are part of its schema."""
    return [each.name for each in fields(record) if each.metadata.get("json", True)]


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
        names = _public(hint) if is_dataclass(hint) else list(hint._fields)
        hints = get_type_hints(hint)
        properties = {name: _schema(hints[name], shared) for name in names}
    return {
        "description": str(hint.__doc__).partition("\n")[0],
        "type": "object",
        "properties": properties,
        "required": list(properties),
        "additionalProperties": False,
    }
