"""The interface of the integrator, for authors of models that move.

`System` names equations compiled by `compiled(rates_signature)`. They read rows of
lanes by `rows` or, with the letters of a named tuple, by `named`, and store them by
`write`; `dry_friction` is a force in them. `integrate` returns the `Solution` of a
block of trials; `solve` that of a `LinearMotion`, exactly. The compiler is loaded with
the first name that needs it.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tolstat.integrator.examination import proposed_scale
    from tolstat.integrator.friction import dry_friction
    from tolstat.integrator.integrate import integrate
    from tolstat.integrator.linear_motion import LinearMotion, solve
    from tolstat.integrator.problem import SIDES, Accuracy, Moment, Solution, System
    from tolstat.integrator.signatures import rates_signature
    from tolstat.lanes.compiled import compiled
    from tolstat.lanes.rows import named, rows, write

_HOMES = {
    "Accuracy": "tolstat.integrator.problem",
    "LinearMotion": "tolstat.integrator.linear_motion",
    "Moment": "tolstat.integrator.problem",
    "SIDES": "tolstat.integrator.problem",
    "Solution": "tolstat.integrator.problem",
    "System": "tolstat.integrator.problem",
    "compiled": "tolstat.lanes.compiled",
    "dry_friction": "tolstat.integrator.friction",
    "integrate": "tolstat.integrator.integrate",
    "named": "tolstat.lanes.rows",
    "proposed_scale": "tolstat.integrator.examination",
    "rates_signature": "tolstat.integrator.signatures",
    "rows": "tolstat.lanes.rows",
    "solve": "tolstat.integrator.linear_motion",
    "write": "tolstat.lanes.rows",
}
__all__ = [
    "SIDES",
    "Accuracy",
    "LinearMotion",
    "Moment",
    "Solution",
    "System",
    "compiled",
    "dry_friction",
    "integrate",
    "named",
    "proposed_scale",
    "rates_signature",
    "rows",
    "solve",
    "write",
]


def __getattr__(name: str) -> Any:
    """Return a name from its module, loaded when first used."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(_HOMES[name]), name)
