"""Parts in one folder, found by the name of their file.

A further distribution or sampler is one more file and edits none.
"""

from __future__ import annotations

import importlib
import pkgutil
from types import ModuleType
from typing import Any


def names_in(folder: ModuleType) -> list[str]:
    """List the parts in a folder, by their names in study files."""
    return sorted(part.name for part in pkgutil.iter_modules(folder.__path__))


def find_in(folder: ModuleType, name: str) -> Any:
    """Return the class of a part: `Normal` in normal.py.

    Parameters
    ----------
    folder : module
        The package that holds the parts.
    name : str
        One of `names_in(folder)`.
    """
    module = importlib.import_module(f"{folder.__name__}.{name}")
    return getattr(module, name.title().replace("_", ""))
