"""Dry friction of a part that slips or sticks: Coulomb's law."""

import numpy as np

from tolstat.arrays import Array
from tolstat.lanes.compiled import compiled


@compiled(within=True)
def dry_friction(slips: Array, grips: Array, load: Array, sliding: Array) -> Array:
    """Return the force of dry friction on a part, N.

    The part sticks while its sliding speed stays at zero and the friction at rest
    exceeds the load. Otherwise it slips, or begins to: the way that the load pulls.

    Parameters
    ----------
    slips : vector
        Side of the crossing of the sliding speed: 1, -1, or 0 at rest.
    grips : vector
        Side of the crossing of the greatest friction at rest, less the size of `load`.
    load : vector
        Force that would move the part if there were no friction, N. While the part
        sticks, its friction is minus this force.
    sliding : vector
        Size of the friction while it slips, N.
    """
    way = np.where(slips == 0.0, np.copysign(1.0, load), slips)
    return np.where((slips == 0.0) & (grips > 0.0), -load, -sliding * way)
