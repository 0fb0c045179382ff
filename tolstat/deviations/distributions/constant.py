"""The same deviation in every unit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tolstat.deviations.distributions import key


@dataclass(frozen=True)
class Constant:
    """The deviation, SI, of a part that was measured, or deviates on purpose."""

    value: float = key("quantity")

    def deviations(self, u: NDArray[np.float64]) -> NDArray[np.float64]:
        """Turn unit samples (0 < u < 1) into deviations, SI."""
        return np.full_like(u, self.value)
