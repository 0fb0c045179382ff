"""TOML: of strangers read only where its depth is bounded, written in its order."""

import re
import tomllib
from collections.abc import Mapping
from typing import Any

import tomli_w

DEEPEST = 16  # tables and lists inside each other
NAME = r"""(?:[\w-]+|"[^"\n]*"|'[^'\n]*')"""
DEEP_KEY = re.compile(rf"(?<![\w.-])(?:{NAME}[ \t]*\.[ \t]*){{{DEEPEST}}}")  # a.b.c ...


def toml_table(text: str) -> dict[str, Any]:
    """Return the keys of a TOML file.

    Raises
    ------
    RecursionError
        If it is too deep.
    ValueError
        If it is not TOML (TOMLDecodeError), or has a number of thousands of digits.
    """
    if DEEP_KEY.search(text):  # which tomllib would take minutes to read
        raise RecursionError(f"more than {DEEPEST} tables inside each other")
    return tomllib.loads(text)


def toml_text(table: Mapping[str, Any]) -> str:
    """Return TOML; the entries of a section keep their order.

    tomli_w writes plain values before tables, and the columns of a chain follow its
    links. So where a plain value comes after a table, the tables stand in its lines.

    Raises
    ------
    TypeError, ValueError, RecursionError
        If a value is not TOML.
    """
    mixed = {name: part for name, part in table.items() if _is_mixed(part)}
    others = {name: part for name, part in table.items() if name not in mixed}
    texts = [tomli_w.dumps(others)] if others else []
    for name, section in mixed.items():
        texts.append("\n".join([f"[{toml_key(name)}]", *_entries(section), ""]))
    return "\n".join(texts)


def _is_mixed(section: Any) -> bool:
    """Return whether a plain value comes after a table, in it or in a table of it."""
    if not isinstance(section, Mapping):
        return False
    are_tables = [isinstance(value, Mapping) for value in section.values()]
    return are_tables != sorted(are_tables) or any(map(_is_mixed, section.values()))


def _entries(section: Mapping[str, Any]) -> list[str]:
    return [f"{toml_key(key)} = {_literal(value)}" for key, value in section.items()]


def toml_keys(section: Mapping[str, Any]) -> str:
    """Return keys as they stand in an inline table, between its braces."""
    return ", ".join(_entries(section))


def toml_key(name: str) -> str:
    """Return a key, quoted if it must be."""
    return tomli_w.dumps({name: 0}).removesuffix(" = 0\n")


def _literal(value: Any) -> str:
    """Return a value in a line."""
    if isinstance(value, Mapping):
        return f"{{ {', '.join(_entries(value))} }}" if value else "{}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_literal, value))}]"
    return tomli_w.dumps({"_": value}).removeprefix("_ = ").rstrip("\n")
