"""Distributions or samplers, one file each in a folder, found by its name."""

from __future__ import annotations

import importlib
import pkgutil
from types import ModuleType
from typing import Any


def names_in(folder: ModuleType) -> list[str]:
    """List the files in a folder, by their names in study files."""
    return sorted(part.name for part in pkgutil.iter_modules(folder.__path__))


def find_in(folder: ModuleType, name: str) -> Any:
    """Return the class of one of `names_in(folder)`: `Normal` in normal.py."""
    module = importlib.import_module(f"{folder.__name__}.{name}")
    return getattr(module, name.title().replace("_", ""))
