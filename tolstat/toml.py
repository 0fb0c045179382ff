"""TOML of strangers: read only where its depth is bounded."""

import re
import tomllib
from typing import Any

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
