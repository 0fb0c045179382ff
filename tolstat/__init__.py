"""Monte Carlo tolerance analysis with the dynamics in the loop."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tolstat.catalogue import names as models
    from tolstat.store.run import Run, open
    from tolstat.study.evaluate import evaluate
    from tolstat.study.run import run
    from tolstat.study.trajectory import trajectory

__all__ = ["Run", "evaluate", "models", "open", "run", "trajectory"]

# loaded when first used: `import tolstat` and `tolstat --help` stay quick
_HOMES = {
    "Run": ("tolstat.store.run", "Run"),
    "evaluate": ("tolstat.study.evaluate", "evaluate"),
    "models": ("tolstat.catalogue", "names"),
    "open": ("tolstat.store.run", "open"),
    "run": ("tolstat.study.run", "run"),
    "trajectory": ("tolstat.study.trajectory", "trajectory"),
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'tolstat' has no attribute {name!r}")
    module, attribute = _HOMES[name]
    value = getattr(importlib.import_module(module), attribute)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return __all__
