"""Distributions of a deviation, by their names in study files.

A distribution is a frozen dataclass. Its fields, declared with `key`, are its keys in
the study file, SI; `tolerance` is the permitted zone. It raises `DistributionError` if
keys contradict each other. The method `deviations(u)` is the inverse distribution
function at 0 < u < 1, SI.
"""

import dataclasses
import math
from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np
from scipy.special import betaincinv, gammaincinv, lambertw, ndtr, ndtri, stdtrit

from tolstat.arrays import Array
from tolstat.errors import DistributionError

MOST_CP = 20.0  # a process of 120 sigma between its limits is a slip
# share of a centred normal distribution below mean + 3 sigma, the upper end of a
# tolerance at Cp = 1
THREE_SIGMA = 0.9986501019683699
ROUNDING = 1e-9  # of the sum of shares
BITS = 60  # of the place between two sources, halved as often
# of a curvilinear trapezoid: shares beside its ends where a series holds, its terms
SMALL, TERMS, STEPS, LEAST_SHARE = 1e-3, 20, 3, 0.5
# of Student's t: two have no standard deviation, and close above two practically all of
# it comes from parts that no run sees
LEAST_FREEDOM = 3.0


class Distribution(Hashable, Protocol):
    """Interface of every distribution."""

    def deviations(self, u: Array) -> Array:
        """Return deviations, SI, at unit samples 0 < u < 1."""
        ...


def key(
    reads: str = "number",
    default: Any = dataclasses.MISSING,
    *,
    choices: Sequence[str] = (),
    check: str = "",
) -> Any:
    """Declare a field that is a key of the study file.

    Parameters
    ----------
    reads : str
        "number"; "quantity", "difference", "mean" or "tolerance", in the unit of the
        contributor; "word"; "parts", a list of entries with their shares.
    default : optional
        Value of a key that the study omits; without a default the key is required.
    choices : sequence of str
        Allowed words.
    check : str
        "above zero", "in zone" for a place or a range in the tolerance; empty for none.
    """
    metadata = {"reads": reads, "choices": tuple(choices), "check": check}
    return dataclasses.field(default=default, metadata=metadata)


class Tolerance(NamedTuple):
    """The permitted zone of a deviation, in the SI unit of its contributor."""

    lower: float
    upper: float

    @property
    def middle(self) -> float:
        """Middle of the zone, the aim of a centred process."""
        return 0.5 * (self.lower + self.upper)

    @property
    def half(self) -> float:
        """Half the width of the zone."""
        return 0.5 * (self.upper - self.lower)


@dataclass(frozen=True)
class Constant:
    """The deviation, SI, of a part that was measured, or deviates on purpose."""

    value: float = key("quantity")

    def deviations(self, u: Array) -> Array:
        """Return deviations, SI, at unit samples 0 < u < 1."""
        return np.full_like(u, self.value)


@dataclass(frozen=True)
class _Toleranced:
    """A distribution with a tolerance."""

    tolerance: Tolerance = key("tolerance")

    def deviations(self, u: Array) -> Array:
        """Return deviations, SI, at unit samples 0 < u < 1."""
        return self._between(*self.tolerance, u)

    def _between(self, lower: float, upper: float, u: Array) -> Array:
        raise NotImplementedError

    def __post_init__(self) -> None:
        """Refuse keys that fail their declared check."""
        lower, upper = self.tolerance
        for field in dataclasses.fields(self):
            name, value = field.name, getattr(self, field.name)
            check = "" if value is None else field.metadata["check"]
            if check == "above zero" and not value > 0:
                raise DistributionError(f"{name} = {value:g}: it must be above zero")
            first, last = value if isinstance(value, tuple) else (value, value)
            if check == "in zone" and not lower <= first <= last <= upper:
                raise DistributionError(f"the {name} lies outside the tolerance")


@dataclass(frozen=True)
class Uniform(_Toleranced):
    """Every deviation inside the tolerance is as likely as any other."""

    def _between(self, lower: float, upper: float, u: Array) -> Array:
        return lower + (upper - lower) * u


@dataclass(frozen=True)
class Arcsine(_Toleranced):
    """Sine of a random phase between the ends of the tolerance (JCGM 101, 6.4.6)."""

    def _between(self, lower: float, upper: float, u: Array) -> Array:
        return lower + (upper - lower) * np.sin(0.5 * np.pi * u) ** 2


@dataclass(frozen=True)
class Circular(_Toleranced):
    """One coordinate of a point that is anywhere in a circle: a zone of position.

    The tolerance is the diameter of the circle. Sigma is a quarter of it (Wigner's
    semicircle; Johnson, Kotz, Balakrishnan, Continuous univariate distributions 2,
    25.1: beta with both exponents 3/2).
    """

    def _between(self, lower: float, upper: float, u: Array) -> Array:
        share = np.asarray(betaincinv(1.5, 1.5, u))
        return np.clip(lower + (upper - lower) * share, lower, upper)  # rounding


@dataclass(frozen=True)
class Triangular(_Toleranced):
    """Triangle over the tolerance."""

    # the most likely deviation, SI; the middle of the tolerance if not given
    mode: float | None = key("quantity", None, check="in zone")

    def _between(self, lower: float, upper: float, u: Array) -> Array:
        mode = self.tolerance.middle if self.mode is None else self.mode
        width = upper - lower
        rising = lower + np.sqrt(u * width * (mode - lower))
        falling = upper - np.sqrt((1 - u) * width * (upper - mode))
        return np.where(u * width < mode - lower, rising, falling)


@dataclass(frozen=True)
class Trapezoidal(_Toleranced):
    """Trapezium over the tolerance: rising, flat, falling (JCGM 101, 6.4.4)."""

    # range of equally likely deviations; the middle half of the tolerance if not given
    plateau: Tolerance | None = key("tolerance", None, check="in zone")

    def _between(self, lower: float, upper: float, u: Array) -> Array:
        quarter = self.tolerance.half / 2
        first, last = self.plateau or (lower + quarter, upper - quarter)
        height = 2 / (upper - lower + last - first)
        rising = lower + np.sqrt(2 * u * (first - lower) / height)
        falling = upper - np.sqrt(2 * (1 - u) * (upper - last) / height)
        share = height * (first - lower) / 2  # of the parts below the plateau
        flat = first + (u - share) / height
        falls = 1 - u < height * (upper - last) / 2
        return np.where(u < share, rising, np.where(falls, falling, flat))


@dataclass(frozen=True)
class Beta(_Toleranced):
    """Beta distribution over the tolerance."""

    # the density rises as the power alpha - 1 from the lower end and falls as the power
    # beta - 1 towards the upper one
    alpha: float = key(check="above zero")
    beta: float = key(check="above zero")

    def _between(self, lower: float, upper: float, u: Array) -> Array:
        share = np.asarray(betaincinv(self.alpha, self.beta, u))
        return np.clip(lower + (upper - lower) * share, lower, upper)  # rounding


@dataclass(frozen=True)
class Lognormal(_Toleranced):
    """Lognormal distribution that begins at the lower end of the tolerance.

    Not truncated: 99.865 % of the parts lie below the upper end, as many as of a normal
    distribution lie below three sigma.
    """

    median: float = key("quantity")  # deviation that half of the parts lie below, SI

    def __post_init__(self) -> None:
        """Refuse a median outside the tolerance."""
        if not self.tolerance.lower < self.median < self.tolerance.upper:
            raise DistributionError("the median lies outside the tolerance")

    def _between(self, lower: float, upper: float, u: Array) -> Array:
        scale = self.median - lower
        sigma = math.log((upper - lower) / scale) / 3
        return lower + scale * np.exp(sigma * np.asarray(ndtri(u)))


@dataclass(frozen=True)
class Weibull(_Toleranced):
    """Weibull distribution that begins at the lower end of the tolerance.

    Not truncated: 99.865 % of the parts lie below the upper end, as many as of a normal
    distribution lie below three sigma.
    """

    # 1 is exponential, 2 the eccentricity of a bore that is normal in both directions
    # (Rayleigh), 3.6 almost symmetric
    shape: float = key(check="above zero")

    def _between(self, lower: float, upper: float, u: Array) -> Array:
        power = 1 / self.shape
        scale = (upper - lower) / (-math.log1p(-THREE_SIGMA)) ** power
        return np.asarray(lower + scale * np.power(-np.log1p(-u), power))


@dataclass(frozen=True)
class StudentT(_Toleranced):
    """Student's t about the middle of the tolerance (JCGM 101, 6.4.9).

    Not truncated: as many parts lie in the tolerance as of a normal distribution within
    three sigma, 99.73 %, but those outside lie farther out.
    """

    # 9 for the mean of ten readings; few are heavy tails, many a normal distribution
    degrees_of_freedom: float = key()

    def __post_init__(self) -> None:
        """Refuse degrees of freedom without a usable standard deviation."""
        if not self.degrees_of_freedom >= LEAST_FREEDOM:
            raise DistributionError(
                f"degrees_of_freedom = {self.degrees_of_freedom:g}: at least "
                f"{LEAST_FREEDOM:g} are needed, with fewer sigma means nothing"
            )

    def _between(self, lower: float, upper: float, u: Array) -> Array:
        freedom = self.degrees_of_freedom
        scale = self.tolerance.half / stdtrit(freedom, THREE_SIGMA)
        return np.asarray(self.tolerance.middle + scale * stdtrit(freedom, u))


@dataclass(frozen=True)
class Normal(_Toleranced):
    """Normal distribution, not truncated: the tolerance is +-3 sigma at Cp = 1."""

    # half the tolerance over three standard deviations
    cp: float | None = key(default=None, check="above zero")
    # distance of the mean from the nearer end over three standard deviations. With `cp`
    # it gives the shift, towards the upper end; with `shift` the standard deviation;
    # alone it is a centred process.
    cpk: float | None = key(default=None, check="above zero")
    # mean less the middle of the tolerance, SI
    shift: float | None = key("difference", None)
    # of a process as statistical control gives it, SI
    mean: float | None = key("mean", None)
    sigma: float | None = key("difference", None, check="above zero")

    def __post_init__(self) -> None:
        """Refuse keys that contradict each other or the tolerance."""
        super().__post_init__()
        for name in ("cp", "cpk"):
            if (ratio := getattr(self, name)) is not None and ratio > MOST_CP:
                raise DistributionError(
                    f"{name} = {ratio:g}: a ratio such as 1.33 is expected, at most "
                    f"{MOST_CP:g}"
                )
        if self.shift is not None and self.mean is not None:
            raise DistributionError("shift and mean say the same thing; give one")
        if self.sigma is not None and (self.cp is not None or self.cpk is not None):
            raise DistributionError("sigma, cp and cpk say the same thing; give one")
        if self._off and abs(self._off) >= self.tolerance.half:
            raise DistributionError("mean outside the tolerance; give a smaller shift")
        if self.cp is not None and self.cpk is not None:
            if self._off is not None:
                raise DistributionError("give two of cp, cpk and shift, not all three")
            if self.cpk > self.cp:
                raise DistributionError(
                    f"cpk = {self.cpk:g} is above cp = {self.cp:g}; it is at most cp"
                )

    @property
    def _off(self) -> float | None:
        """Mean less the middle of the tolerance, SI; None where it is not given."""
        return self.shift if self.mean is None else self.mean - self.tolerance.middle

    @property
    def mean_and_sigma(self) -> tuple[float, float]:
        """Mean and standard deviation, SI."""
        half = self.tolerance.half
        if self.cp is not None and self.cpk is not None:
            shift, sigma = half * (1 - self.cpk / self.cp), half / (3 * self.cp)
        elif self.cpk is not None:
            shift = self._off or 0.0
            sigma = (half - abs(shift)) / (3 * self.cpk)
        else:
            shift, sigma = self._off or 0.0, self.sigma or half / (3 * (self.cp or 1.0))
        return self.tolerance.middle + shift, sigma

    def _between(self, lower: float, upper: float, u: Array) -> Array:
        mean, sigma = self.mean_and_sigma
        return mean + sigma * np.asarray(ndtri(u))


@dataclass(frozen=True, kw_only=True)
class TruncatedNormal(Normal):
    """Normal process whose parts outside the tolerance are replaced or reworked."""

    # "screened": other parts replace parts outside; "clipped": parts outside are
    # reworked to the nearer end
    outside: str = key("word", choices=("screened", "clipped"))

    def _between(self, lower: float, upper: float, u: Array) -> Array:
        mean, sigma = self.mean_and_sigma
        if self.outside == "screened":
            below, above = ndtr((lower - mean) / sigma), ndtr((mean - upper) / sigma)
            u = below + u * (1 - below - above)
        parts = mean + sigma * np.asarray(ndtri(u))
        # screening ends at the tolerance but for rounding
        return np.clip(parts, lower, upper)


@dataclass(frozen=True)
class Gamma(_Toleranced):
    """Gamma distribution that begins at the lower end of the tolerance.

    Not truncated: 99.865 % of the parts lie below the upper end.
    """

    shape: float = key(check="above zero")  # 1 is exponential, large almost symmetric

    def _between(self, lower: float, upper: float, u: Array) -> Array:
        share = gammaincinv(self.shape, u) / gammaincinv(self.shape, THREE_SIGMA)
        return np.asarray(lower + (upper - lower) * share)


@dataclass(frozen=True)
class Gumbel(_Toleranced):
    """Gumbel distribution of the largest of many: a long tail upwards.

    Not truncated: 0.135 % of the parts lie below the tolerance, as many above it.
    """

    def _between(self, lower: float, upper: float, u: Array) -> Array:
        first, last = (-math.log(-math.log(x)) for x in (1 - THREE_SIGMA, THREE_SIGMA))
        return lower + (upper - lower) * (-np.log(-np.log(u)) - first) / (last - first)


@dataclass(frozen=True)
class CurvilinearTrapezoid(_Toleranced):
    """Uniform between ends that are known inexactly (JCGM 101, 6.4.3)."""

    # each end lies so far to either side of that of the tolerance, at most, SI
    inexactness: float = key("difference", check="above zero")

    def __post_init__(self) -> None:
        """Refuse ends that may change places."""
        super().__post_init__()
        if self.inexactness >= self.tolerance.half:
            raise DistributionError("inexactness is less than half the tolerance")

    def _between(self, lower: float, upper: float, u: Array) -> Array:
        half, d = self.tolerance.half, self.inexactness
        reach, flank = half + d, np.minimum(u, 1 - u)
        # below the flat part: share y of the reach with y ln y - y + 1 = q
        q = 4 * d * flank / reach
        e = np.sqrt(2 * q) - q / 3  # 1 - y where q is small
        exact = 1 - np.exp(1 + lambertw((q - 1) / math.e, -1).real)
        for _ in range(STEPS):  # by Newton: there the closed form loses figures
            rise = sum(e**k / (k * (k - 1)) for k in range(2, TERMS))
            e = e - (rise - q) / -np.log1p(-np.minimum(e, LEAST_SHARE))
        e = np.where(q < SMALL, e, exact)
        # of the parts up to the end of the flank, and the flat density beyond
        edge = (half - d) / reach
        share = (1 - edge + edge * math.log(edge)) * reach / (4 * d)
        density = -math.log(edge) / (4 * d)
        flat = d - half + (flank - share) / density
        away = np.where(flank < share, reach * (e - 1), flat)
        return self.tolerance.middle + np.where(u < 0.5, away, -away)


class Source(NamedTuple):
    """A source of normal parts: its share of all, mean and sigma, SI."""

    share: float
    mean: float
    sigma: float


@dataclass(frozen=True)
class Mixture:
    """Parts of several sources, such as suppliers."""

    parts: tuple[Source, ...] = key("parts")

    def __post_init__(self) -> None:
        """Refuse shares whose sum is not 1."""
        total = math.fsum(share for share, *_ in self.parts)
        least = min((share for share, *_ in self.parts), default=0.0)
        if not least > 0 or abs(total - 1) > ROUNDING:
            raise DistributionError(
                f"shares of a mixture are above 0 and 100 % together, not "
                f"{100 * total:.6g} %"
            )

    def deviations(self, u: Array) -> Array:
        """Return deviations, SI, at unit samples 0 < u < 1."""
        scores = np.asarray(ndtri(u))
        quantiles = np.array([mean + sigma * scores for _, mean, sigma in self.parts])
        low, high = quantiles.min(axis=0), quantiles.max(axis=0)
        sign = np.where(u < 0.5, 1.0, -1.0)  # the smaller tail keeps its figures
        tail = np.minimum(u, 1 - u)
        for _ in range(BITS):
            middle = 0.5 * (low + high)
            below = sum(
                share * ndtr(sign * (middle - mean) / sigma)
                for share, mean, sigma in self.parts
            )
            rises = sign * (below - tail) < 0
            low, high = np.where(rises, middle, low), np.where(rises, high, middle)
        return np.asarray(0.5 * (low + high))


DISTRIBUTIONS: dict[str, type[Distribution]] = {
    "arcsine": Arcsine,
    "beta": Beta,
    "circular": Circular,
    "constant": Constant,
    "curvilinear_trapezoid": CurvilinearTrapezoid,
    "gamma": Gamma,
    "gumbel": Gumbel,
    "lognormal": Lognormal,
    "mixture": Mixture,
    "normal": Normal,
    "student_t": StudentT,
    "trapezoidal": Trapezoidal,
    "triangular": Triangular,
    "truncated_normal": TruncatedNormal,
    "uniform": Uniform,
    "weibull": Weibull,
}
