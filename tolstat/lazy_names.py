"""Names of a package that are loaded when they are first used."""

import importlib
from functools import cache
from pathlib import Path
from typing import Any


def lazy_name(package_file: str, name: str) -> Any:
    """Return a name that the `__init__` file of a package imports for type checkers."""
    home, original = _homes(package_file)[name]
    return getattr(importlib.import_module(home), original)


@cache
def _homes(package_file: str) -> dict[str, tuple[str, str]]:
    """Return module and name there of each name, from the imports of a file."""
    import ast

    block = ast.parse(Path(package_file).read_text("utf-8"))
    return {
        alias.asname or alias.name: (node.module or "", alias.name)
        for node in ast.walk(block)
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
