"""Normal distribution: parts from a process of known capability."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from tolstat.deviations.distributions import key
from tolstat.deviations.tolerance import Tolerance
from tolstat.errors import DistributionError


@dataclass(frozen=True)
class Normal:
    """Normal distribution, not truncated: the tolerance is +-3 sigma at Cp = 1.

    Attributes
    ----------
    cp : float, optional
        Half the tolerance over three standard deviations.
    cpk : float, optional
        Distance of the mean from the nearer end over three standard deviations. With
        `cp` it gives the shift, towards the upper end; with `shift` the standard
        deviation; alone it is a centred process.
    shift : float, optional
        Mean less the middle of the tolerance, SI.
    """

    tolerance: Tolerance = key("tolerance")
    cp: float | None = key(default=None)
    cpk: float | None = key(default=None)
    shift: float | None = key("quantity", None)

    def __post_init__(self) -> None:
        """Refuse keys that contradict each other or the tolerance."""
        for name in ("cp", "cpk"):
            value = getattr(self, name)
            if value is not None and not value > 0:
                raise DistributionError(f"{name} = {value:g}: it must be above zero")
        if self.shift is not None and abs(self.shift) >= self.tolerance.half:
            raise DistributionError(
                "the shift puts the mean outside the tolerance; give one below half "
                "its width"
            )
        if self.cp is not None and self.cpk is not None:
            if self.shift is not None:
                raise DistributionError(
                    "cp, cpk and shift say one thing too many; give two of them"
                )
            if self.cpk > self.cp:
                raise DistributionError(
                    f"cpk = {self.cpk:g} is above cp = {self.cp:g}; it is at most cp"
                )

    @property
    def mean_and_sigma(self) -> tuple[float, float]:
        """Mean and standard deviation, SI."""
        half = self.tolerance.half
        if self.cp is not None and self.cpk is not None:
            shift, sigma = half * (1 - self.cpk / self.cp), half / (3 * self.cp)
        elif self.cpk is not None:
            shift = self.shift or 0.0
            sigma = (half - abs(shift)) / (3 * self.cpk)
        else:
            shift, sigma = self.shift or 0.0, half / (3 * (self.cp or 1.0))
        return self.tolerance.middle + shift, sigma

    def deviations(self, u: NDArray[np.float64]) -> NDArray[np.float64]:
        """Turn unit samples (0 < u < 1) into deviations, SI."""
        mean, sigma = self.mean_and_sigma
        return mean + sigma * np.asarray(ndtri(u))
