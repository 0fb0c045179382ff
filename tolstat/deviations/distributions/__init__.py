"""Distributions of a deviation, one in each file.

A distribution is a frozen dataclass. Its fields, declared with `key`, are its keys in
the study file, SI; `tolerance` is the permitted zone. It raises `DistributionError`
when they do not fit each other. Its one method, `deviations(u)`, is the inverse
distribution function at 0 < u < 1, SI.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

# share of a centred normal distribution below mean + 3 sigma: where the far end of a
# tolerance lies at Cp = 1
THREE_SIGMA = 0.9986501019683699


class Distribution(Protocol):
    """The distribution that each file of this folder holds."""

    def deviations(self, u: NDArray[np.float64]) -> NDArray[np.float64]:
        """Turn unit samples (0 < u < 1) into deviations, SI."""
        ...


def key(
    reads: str = "number",
    default: Any = dataclasses.MISSING,
    *,
    choices: Sequence[str] = (),
) -> Any:
    """Declare a field that is a key of the study file.

    Parameters
    ----------
    reads : str
        "number"; "quantity" or "tolerance", in the unit of the contributor; "word".
    default : optional
        Value of a key that the study leaves out; without one the key is required.
    choices : sequence of str
        The words allowed.
    """
    metadata = {"reads": reads, "choices": tuple(choices)}
    return dataclasses.field(default=default, metadata=metadata)
