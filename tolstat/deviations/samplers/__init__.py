"""Ways to choose unit samples, one in each file.

A sampler is a class with one method, `unit_samples(seed, names, trials)`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray


class Sampler(Protocol):
    """What every file of this folder holds."""

    def unit_samples(
        self, seed: int, names: Sequence[str], trials: int
    ) -> NDArray[np.float64]:
        """Return float64[trial, contributor], each above 0 and below 1."""
        ...
