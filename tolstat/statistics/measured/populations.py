"""What the population may be that measured parts were taken from."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.special import ndtr, ndtri

from tolstat.arrays import Array, Integers
from tolstat.statistics.lots import LotEffect, lot_effect

LEAST_PARTS = 5  # fewer tell nothing of the tails
MOST_PARTS = 10_000  # that a population is drawn from: more tell no more
DOUBTFUL_FIT = 0.05  # p-value below which a fit is not believed
LOGNORMAL = "lognormal"

Population = Callable[[Array], Array]  # deviations at unit samples


@dataclass(frozen=True, eq=False)
class MeasuredSample:
    """Measured parts of one entry of a study.

    Attributes
    ----------
    name : str
        Of the entry.
    contributors : tuple of str
        Contributors that are sampled from these parts.
    values : float64[part]
        Deviations, SI, ascending.
    fit : str
        "normal", "lognormal", or empty: the parts themselves are sampled.
    p_value : float
        Of the test of the fit (Anderson-Darling); NaN without a fit.
    order : int64[part] or None
        Places of the parts among the values, in the order in which they were measured;
        None where that is not known.
    lot : int64[part] or None
        The lot of each, in that order: its place in `lot_names`; None without lots.
    lot_names : tuple of str
        The lots.
    lower, upper : float
        The tolerance of the drawing, as deviations, SI; infinite where it is open.
    source : str
        Where they come from, and how that was read.
    """

    name: str
    contributors: tuple[str, ...]
    values: Array
    fit: str = ""
    p_value: float = math.nan
    order: Integers | None = None
    lot: Integers | None = None
    lot_names: tuple[str, ...] = ()
    lower: float = -math.inf
    upper: float = math.inf
    source: str = ""

    @property
    def parts(self) -> int:
        """How many parts were measured."""
        return len(self.values)

    @property
    def is_constant(self) -> bool:
        """Whether all parts are equal: they may be rounded, and tell no spread."""
        return bool(np.ptp(self.values) == 0)

    @property
    def fit_decides(self) -> bool:
        """Whether verdicts rest on the fit: there is one, and its test passes it."""
        return bool(self.fit) and not self.p_value < DOUBTFUL_FIT

    def unit_samples(self, deviations: Array, generator: np.random.Generator) -> Array:
        """Return unit samples that sampled deviations come from.

        One of parts is anywhere in the range of unit samples that the part stands for.
        """
        if self.fit:
            scores, mean, sigma = _scores(deviations, self.fit), *self._moments
            return np.asarray(ndtr((scores - mean) / sigma))
        first = np.searchsorted(self.values, deviations, "left")
        last = np.searchsorted(self.values, deviations, "right")
        place = first + generator.random(len(deviations)) * np.maximum(last - first, 1)
        return np.asarray(np.clip(place / self.parts, 2.0**-53, 1 - 2.0**-53))

    def populations(
        self,
        draws: int,
        generator: np.random.Generator,
        *,
        fitted: bool,
        tails: bool = True,
    ) -> Iterator[Population]:
        """Return draws of the population, of the fitted family or of any kind.

        Without `tails` no part lies outside those that were measured. All parts of a
        lot may lie beside those of other lots: few lots tell little of their mean.
        """
        if fitted:
            drawn = self._fitted(draws, generator)
        elif tails:
            drawn = self._any(draws, generator)
        else:
            drawn = self._inside(draws, generator)
        if not (effect := self.lot_effect):
            return drawn
        error = effect.of_lots * generator.standard_t(effect.lots - 1, draws)
        return map(_shifted, drawn, error.tolist())

    @cached_property
    def lot_effect(self) -> LotEffect | None:
        """How lots differ; None without lots, or if their parts explain it."""
        if self.lot is None or self.order is None:
            return None
        lots = [self.lot_names[number] for number in self.lot]
        return lot_effect(self.values[self.order], lots)

    @property
    def few_lots(self) -> int:
        """How many lots there are, if the mean errs more by them than by its parts.

        Otherwise 0: then parts are what is few.
        """
        if not (effect := self.lot_effect):
            return 0
        of_parts = float(self.values.std(ddof=1)) / math.sqrt(self.parts)
        return effect.lots if effect.of_lots > of_parts else 0

    def enlarged(self, number: int) -> "MeasuredSample":
        """Return so many parts as of the same population, with its mean and sigma.

        Where lots are what is few, so many lots of the same size.
        """
        parts, effect = number, self.lot_effect
        if effect and self.few_lots:
            parts = round(number * self.parts / effect.lots)
            effect = effect._replace(lots=number)
        before = _scores(self.values, self.fit)
        scores = _likely(before, min(max(parts, self.parts), MOST_PARTS))
        sigma = scores.std(ddof=1)
        factor = before.std(ddof=1) / sigma if sigma > 0 else 1.0
        scores = before.mean() + factor * (scores - scores.mean())
        values = np.exp(scores) if self.fit == LOGNORMAL else scores
        return LargerSample(
            self.name, self.contributors, values, self.fit, self.p_value, effect=effect
        )

    @property
    def _moments(self) -> tuple[float, float]:
        scores = _scores(self.values, self.fit)
        return float(scores.mean()), float(scores.std(ddof=1))

    def _fitted(
        self, draws: int, generator: np.random.Generator
    ) -> Iterator[Population]:
        """Yield normal populations: mean and sigma as their sample distributes them."""
        (mean, sigma), n = self._moments, self.parts
        spreads = sigma * np.sqrt((n - 1) / generator.chisquare(n - 1, draws))
        means = mean + spreads / math.sqrt(n) * generator.standard_normal(draws)

        def population(middle: float, spread: float) -> Population:
            def deviations(u: Array) -> Array:
                scores = middle + spread * np.asarray(ndtri(u))
                return np.exp(scores) if self.fit == LOGNORMAL else scores

            return deviations

        return map(population, means.tolist(), spreads.tolist())

    def _inside(
        self, draws: int, generator: np.random.Generator
    ) -> Iterator[Population]:
        """Yield populations of the parts alone, by a Bayesian bootstrap."""
        for places in generator.dirichlet(np.ones(self.parts), draws).cumsum(axis=1):

            def deviations(u: Array, places: Array = places) -> Array:
                inside = np.searchsorted(places, u)
                return self.values[np.minimum(inside, self.parts - 1)]

            yield deviations

    def _any(self, draws: int, generator: np.random.Generator) -> Iterator[Population]:
        """Yield populations with the parts in the middle, and exponential tails.

        The shares of the parts, and those of the tails, are as order statistics have
        them: the body by a Bayesian bootstrap, the tails by a beta distribution. How
        far a tail reaches is known by the parts in it.
        """
        n, x = self.parts, self.values
        k = _in_tail(n)
        low, high, body = x[k], x[n - k - 1], x[k : n - k]
        for _ in range(draws):
            shares = generator.beta(k + 1, n - k, 2)
            above, below = shares / max(1.0, shares.sum())
            up = np.sum(x[n - k :] - high) / generator.gamma(k)
            down = np.sum(low - x[:k]) / generator.gamma(k)
            steps = np.cumsum(generator.dirichlet(np.ones(len(body))))
            places = below + (1 - above - below) * steps

            def deviations(
                u: Array,
                tails: Sequence[float] = (below, above, down, up),
                places: Array = places,
            ) -> Array:
                inside = np.searchsorted(places, u)
                q = body[np.minimum(inside, len(body) - 1)]
                return _tailed(q, u, low, high, tails)

            yield deviations


@dataclass(frozen=True, eq=False)
class LargerSample(MeasuredSample):
    """Parts that might be measured, and how their lots would differ."""

    effect: LotEffect | None = None

    @property
    def lot_effect(self) -> LotEffect | None:
        """How lots differ."""
        return self.effect


def _shifted(population: Population, shift: float) -> Population:
    return lambda u: population(u) + shift


def _scores(values: Array, fit: str) -> Array:
    return np.asarray(np.log(values)) if fit == LOGNORMAL else values


def _in_tail(parts: int) -> int:
    """Return how many parts show a tail."""
    return max(2, min(math.ceil(math.sqrt(parts)), (parts - 1) // 2))


def _tailed(
    q: Array, u: Array, low: float, high: float, tails: Sequence[float]
) -> Array:
    """Return deviations with exponential tails: their shares, and their means."""
    below, above, down, up = tails
    with np.errstate(divide="ignore", invalid="ignore"):
        q = np.where(u > 1 - above, high - up * np.log((1 - u) / above), q)
        return np.where(u < below, low + down * np.log(u / below), q)


def _likely(x: Array, parts: int) -> Array:
    """Return so many parts of the likely population: as x, with normal tails."""
    before, after = (ndtri((np.arange(n) + 0.5) / n) for n in (len(x), parts))
    outside = after - np.clip(after, before[0], before[-1])
    return np.asarray(np.interp(after, before, x) + x.std(ddof=1) * outside)
