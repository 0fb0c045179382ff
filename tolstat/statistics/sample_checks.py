"""What a quality engineer looks for in measured parts before any number counts.

Two kinds of parts, a tail cut off at a limit, a trend, coarse rounding, outliers, lots
that differ. Each check returns what it found, or None; a false alarm is rarer than one
in twenty samples of normal parts.
"""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.special import bdtr, stdtrit

from tolstat.arrays import Array, Integers
from tolstat.statistics.capability import Tolerance
from tolstat.statistics.lots import by_lot

FEWEST = 10  # parts that are checked
LEVEL = 0.01
GRID = 256  # points of a density
LEAST_PEAK = 0.1  # of the parts
LEAST_GAIN = 6.0  # of Schwarz's criterion: strong evidence
DEEPEST_SHOULDER = 0.7  # of the lower peak
SPLITS = 0.2, 0.35, 0.5, 0.65, 0.8  # where the fit of two bells begins
NARROWEST, ROUNDS = 0.1, 200
FEWEST_CUT = 30
BAND = 0.5  # of sigma: beside a limit
STEPS = 1.0, 2.0, 5.0  # times powers of ten, in which a gauge rounds
MOST_STEP = 0.05, 0.5  # of the tolerance; of sigma
MOST_OUTLIERS = 10
MOST_SLOPES = 1000  # parts that the slope of a trend is taken from
NOTHING = np.empty(0, np.int64)


class TwoPeaks(NamedTuple):
    """Two kinds of parts: where each lies, SI, and the share of the lower one."""

    lower: float
    upper: float
    share: float


class CutOff(NamedTuple):
    """A tail that ends at a limit."""

    end: float  # SI
    expected: float  # parts beyond it, by the density before it
    p_value: float


class Trend(NamedTuple):
    """Parts that drift in the order in which they are given."""

    drift: float  # from the first to the last, SI
    correlation: float  # Kendall's tau
    p_value: float


class LotsDiffer(NamedTuple):
    """Lots with different medians."""

    lowest: str
    highest: str
    p_value: float


def outliers(values: Array) -> Integers:
    """Return the indices of parts far from all others, the farthest first.

    References
    ----------
    B. Rosner, Percentage points for a generalized ESD many-outlier procedure,
    Technometrics 25 (1983) 165-172.
    """
    n = len(values)
    if n < FEWEST:
        return NOTHING
    rest = np.arange(n)
    removed, last = [], 0
    for i in range(min(MOST_OUTLIERS, max(1, n // 10))):
        left = values[rest]
        spread = left.std(ddof=1)
        if not spread > 0:
            break
        distance = np.abs(left - left.mean()) / spread
        farthest = int(distance.argmax())
        freedom = n - i - 2
        t = float(stdtrit(freedom, 1 - LEVEL / (2 * (n - i))))
        critical = (n - i - 1) * t / math.sqrt((freedom + t**2) * (n - i))
        removed.append(int(rest[farthest]))
        if distance[farthest] > critical:
            last = i + 1
        rest = np.delete(rest, farthest)
    return np.array(removed[:last], np.int64)


def two_peaks(values: Array) -> TwoPeaks | None:
    """Return two kinds of parts, each normal, if they are parted by a valley.

    Two bells have to explain the parts much better than one (Schwarz's criterion), and
    their density has to fall well below its lower peak between them: a skewed or a flat
    one does not.
    """
    parts = np.sort(values)
    if len(parts) < 2 * FEWEST or not np.ptp(parts) > 0:
        return None
    single = float(_log_density(parts, parts.mean(), parts.std()).sum())
    splits = (int(share * len(parts)) for share in SPLITS)
    likelihood, bells = max(
        (_two_bells(parts, split) for split in splits), key=lambda pair: pair[0]
    )
    gain = 2 * (likelihood - single) - 3 * math.log(len(parts))
    share, (lower, upper) = bells[0][0], bells[:, 1].tolist()
    if gain < LEAST_GAIN or not LEAST_PEAK <= share <= 1 - LEAST_PEAK:
        return None
    points = np.linspace(lower, upper, GRID)
    density = sum(w * np.exp(_log_density(points, m, sd)) for w, m, sd in bells)
    least = float(np.min(density))
    if not least < DEEPEST_SHOULDER * min(float(density[0]), float(density[-1])):
        return None
    if not _is_valley(parts, lower, upper, float(points[int(np.argmin(density))])):
        return None
    return TwoPeaks(lower, upper, float(share))


def _is_valley(parts: Array, lower: float, upper: float, valley: float) -> bool:
    """Return whether a valley holds fewer parts than either peak, beyond chance.

    A flat density has as many in each; equally wide bands are compared.
    """
    half = (upper - lower) / 6

    def count(place: float) -> int:
        return int(np.count_nonzero(np.abs(parts - place) < half))

    inside, beside = count(valley), min(count(lower), count(upper))
    return float(bdtr(inside, inside + beside, 0.5)) < LEVEL


def _two_bells(parts: Array, split: int) -> tuple[float, Array]:
    """Return the likelihood of two bells, and share, mean, sigma of each.

    By expectation and maximization from a split of the ordered parts. No bell is
    narrower than a tenth of all.
    """
    least, likelihood = NARROWEST * parts.std(), -math.inf
    members = np.zeros((2, len(parts)))
    members[0, :split] = members[1, split:] = 1.0
    for _ in range(ROUNDS):
        sizes = members.sum(axis=1)
        means = members @ parts / sizes
        squares = (members * (parts - means[:, None]) ** 2).sum(axis=1) / sizes
        sigmas = np.maximum(np.sqrt(squares), least)
        logs = _log_density(parts, means[:, None], sigmas[:, None])
        logs += np.log(sizes / len(parts))[:, None]
        total = np.logaddexp(*logs)
        members = np.maximum(np.exp(logs - total), 1e-300)
        likelihood, before = float(total.sum()), likelihood
        if likelihood - before < 1e-6 * len(parts):
            break
    bells = np.stack([sizes / len(parts), means, sigmas], axis=1)
    return likelihood, bells[np.argsort(means)]


def _log_density(values: Array, mean: Any, sigma: Any) -> Array:
    """Return the logarithm of a normal density."""
    score = (values - mean) / sigma
    density: Array = -0.5 * score**2 - np.log(sigma) - 0.5 * math.log(2 * math.pi)
    return density


def cut_off(values: Array, end: float) -> CutOff | None:
    """Return a tail that ends at a limit, as parts do that were sorted by it.

    As many parts lie in a band inside the limit, and none beyond it: chance leaves it
    empty with exp(-expected).
    """
    if len(values) < FEWEST_CUT or not math.isfinite(end):
        return None
    side = 1.0 if end > np.median(values) else -1.0
    distance, band = side * (end - values), BAND * float(values.std())
    if (distance < 0).any() or not band > 0:
        return None
    near = int(np.count_nonzero(distance < band))
    farther = int(np.count_nonzero((distance >= band) & (distance < 2 * band)))
    # a bell falls ever faster: by exp(-band^2/sigma^2) from band to band
    ratio = min(1.0, near / max(farther, 1)) * math.exp(-(BAND**2))
    expected = near * ratio
    p_value = math.exp(-expected)
    return CutOff(end, float(expected), p_value) if p_value < LEVEL else None


def trend(values: Array) -> Trend | None:
    """Return a drift of the parts in their order (Kendall's test, Theil's slope)."""
    from scipy import stats  # slow to import

    if len(values) < FEWEST or is_sorted(values) or not np.ptp(values) > 0:
        return None
    order = np.arange(len(values))
    tau, p_value = stats.kendalltau(order, values)
    if not p_value < LEVEL / 10:
        return None
    few = slice(None, None, -(-len(values) // MOST_SLOPES))  # it takes all pairs
    slope = float(stats.theilslopes(values[few], order[few])[0])
    return Trend(slope * (len(values) - 1), float(tau), float(p_value))


def is_sorted(values: Array) -> bool:
    """Return whether parts stand in the order of their size."""
    steps = np.diff(values)
    rises = bool((steps >= 0).all() or (steps <= 0).all())
    return len(values) >= FEWEST and rises


def lots_differ(values: Array, lots: Sequence[str]) -> LotsDiffer | None:
    """Return lots with different medians (Kruskal and Wallis)."""
    from scipy import stats  # slow to import

    groups = by_lot(values, lots)
    if len(groups) < 2 or not np.ptp(values) > 0:
        return None
    p_value = float(stats.kruskal(*groups.values()).pvalue)
    if not p_value < LEVEL / 10:
        return None
    by_median = sorted(groups, key=lambda lot: float(np.median(groups[lot])))
    return LotsDiffer(by_median[0], by_median[-1], p_value)


def step_of(written: Sequence[float]) -> float:
    """Return the step in which numbers are rounded, in their unit; 0 for none.

    Examples
    --------
    >>> step_of([20.05, 20.1, 19.95, 20.0])
    0.05
    """
    numbers = np.array(written)
    if not np.ptp(numbers) > 0:
        return 0.0
    first = math.floor(math.log10(float(np.ptp(numbers)))) + 1
    for power in range(first, first - 8, -1):
        for times in reversed(STEPS):
            step = times * 10.0**power
            rest = np.abs(numbers / step - np.round(numbers / step))
            if (rest < 1e-6).all():
                return float(f"{step:.3g}")
    return 0.0


def is_coarse(step: float, sigma: float, tolerance: Tolerance) -> bool:
    """Return whether a step is large beside the tolerance or the spread."""
    of_tolerance, of_sigma = MOST_STEP
    width = tolerance.upper - tolerance.lower
    return step > of_sigma * sigma or (
        math.isfinite(width) and step > of_tolerance * width
    )
