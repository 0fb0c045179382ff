"""What a machine that moves is built of: the integrator's face, for authors.

`System` names equations compiled by `compiled(rates_signature)`; they read rows of
lanes by `rows` or, with the letters of a named tuple, by `named`, and store them by
`write`. `integrate` takes a block of machines and returns their `Solution`. Importing
this module loads the compiler; a machine whose words are to be quick to show imports it
where it integrates.
"""

from __future__ import annotations

from tolstat.integrator.integrate import System, integrate
from tolstat.integrator.signatures import rates_signature
from tolstat.integrator.trials import Accuracy, Solution
from tolstat.lanes.compiled import compiled
from tolstat.lanes.rows import named, rows, write

__all__ = [
    "Accuracy",
    "Solution",
    "System",
    "compiled",
    "integrate",
    "named",
    "rates_signature",
    "rows",
    "write",
]
