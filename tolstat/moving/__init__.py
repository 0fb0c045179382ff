"""The interface of the integrator, for authors of models that move.

`System` names equations compiled by `compiled(rates_signature)`. They read rows of
lanes by `rows` or, with the letters of a named tuple, by `named`, and store them by
`write`; `dry_friction` is a force in them. `integrate` returns the `Solution` of a
block of trials; `solve` that of a `LinearMotion`, exactly. The compiler is loaded with
the first name that needs it.
"""

from typing import TYPE_CHECKING, Any

from tolstat.lazy_names import lazy_name

if TYPE_CHECKING:
    from tolstat.integrator.crossing import dry_friction
    from tolstat.integrator.examination import proposed_scale
    from tolstat.integrator.integrate import integrate
    from tolstat.integrator.linear_motion import LinearMotion, solve
    from tolstat.integrator.problem import SIDES, Accuracy, Moment, Solution, System
    from tolstat.integrator.signatures import rates_signature
    from tolstat.lanes.compiled import compiled
    from tolstat.lanes.rows import named, rows, write
    from tolstat.moving.declarations import Part, Response, State
    from tolstat.moving.events import contact, ends, held, impact, memory, sampled
    from tolstat.moving.motion import Motion

__all__ = [
    "SIDES", "Accuracy", "LinearMotion", "Moment", "Motion", "Part", "Response",
    "Solution", "State", "System", "compiled", "contact", "dry_friction", "ends",
    "held", "impact", "integrate", "memory", "named", "proposed_scale",
    "rates_signature", "rows", "sampled", "solve", "write",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    """Return a name from its module, loaded when first used."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return lazy_name(__file__, name)
