"""Distributions of a deviation inside its tolerance, one in each file.

A distribution is a frozen dataclass whose fields are its keys in the study file. A
field declared with `deviation_field` is a quantity in the contributor's unit. It has
one method, `deviations(u, tolerance)`: the inverse distribution function at
0 < u < 1, which raises `DistributionError` when the keys do not fit the tolerance.
"""

from __future__ import annotations

import dataclasses
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from tolstat.deviations.tolerance import Tolerance


class Distribution(Protocol):
    """What every file of this folder holds."""

    def deviations(
        self, u: NDArray[np.float64], tolerance: Tolerance
    ) -> NDArray[np.float64]:
        """Turn unit samples (0 < u < 1) into deviations, SI."""
        ...


def deviation_field(default: float | None) -> Any:
    """Declare a key that is a quantity in the contributor's unit."""
    return dataclasses.field(default=default, metadata={"in_unit_of_contributor": True})
