"""Distributions of measured parts: the parts themselves, or a fit."""

from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from scipy.special import ndtri

from tolstat.arrays import Array, Integers
from tolstat.deviations.distributions import Tolerance
from tolstat.errors import DistributionError

DOUBTFUL = 0.05  # p-value below which a fit is doubtful
RESAMPLES = 999
# most parts of a simulated sample: A^2 of more has the same distribution
MOST_SIMULATED = 2000


class InOrder(NamedTuple):
    """What trials do not need of measured parts, and their judgement does."""

    order: Integers  # places among the ascending parts, as they were measured
    lots: tuple[str, ...]  # of each, in that order; empty without lots
    tolerance: Tolerance  # of the drawing: deviations, SI; open ends are infinite
    source: str  # file, and how it was read


@dataclass(frozen=True, eq=False)
class Measured:
    """Measured parts, each equally likely: float64[part] deviations, SI, ascending."""

    values: Array

    def __eq__(self, other: object) -> bool:
        """Return whether all parts are the same."""
        return isinstance(other, Measured) and np.array_equal(self.values, other.values)

    @property
    def parts(self) -> int:
        """Number of parts."""
        return len(self.values)

    def __hash__(self) -> int:
        return hash(self.values.tobytes())

    def deviations(self, u: Array) -> Array:
        """Return deviations, SI, at unit samples 0 < u < 1."""
        return self.values[(u * len(self.values)).astype(np.int64)]


@dataclass(frozen=True)
class Fitted:
    """Normal or lognormal distribution fitted to measured parts."""

    kind: str  # "normal", or "lognormal" (above zero)
    # of the deviations, SI, or of their natural logarithms; sigma with N - 1
    mean: float
    sigma: float
    # p-value of the Anderson-Darling test with both parameters estimated, from 999
    # simulated samples
    p_value: float
    parts: int  # that were measured
    # float64[part]: their deviations, SI, ascending
    values: Array = field(default_factory=lambda: np.zeros(0), compare=False)

    def deviations(self, u: Array) -> Array:
        """Return deviations, SI, at unit samples 0 < u < 1."""
        scores = self.mean + self.sigma * np.asarray(ndtri(u))
        return np.exp(scores) if self.kind == "lognormal" else scores


def fit(values: Array, kind: str) -> Fitted:
    """Fit a distribution to measured parts.

    Raises `DistributionError` if the parts are too few or equal, or not above zero for
    a lognormal one.
    """
    if len(values) < 8:
        raise DistributionError(f"{len(values)} parts are too few to fit; 8 are needed")
    parts = values
    if kind == "lognormal":
        if values.min() <= 0:
            raise DistributionError("not all parts are above zero; fit a normal one")
        values = np.log(values)
    if np.ptp(values) == 0:
        raise DistributionError("all parts are equal; a fit needs parts that differ")
    sigma = float(values.std(ddof=1))
    mean, p_value = float(values.mean()), _p_value(values)
    return Fitted(kind, mean, sigma, p_value, len(values), np.sort(parts))


def _p_value(values: Array) -> float:
    """Return the share of true normal samples that fit worse (Anderson-Darling)."""
    from scipy import stats  # slow to import

    def tested(sample: Array, resamples: int) -> Any:
        return stats.goodness_of_fit(
            stats.norm, sample, statistic="ad", n_mc_samples=resamples,
            rng=np.random.default_rng(0),
        )  # fmt: skip

    if len(values) <= MOST_SIMULATED:
        return float(tested(values, RESAMPLES).pvalue)
    statistic = tested(values, 1).statistic
    scores = ndtri((np.arange(MOST_SIMULATED) + 0.5) / MOST_SIMULATED)
    simulated = tested(scores, RESAMPLES).null_distribution
    return float((np.count_nonzero(simulated >= statistic) + 1) / (RESAMPLES + 1))
