"""Numbers of a run as uncertain as the few measured parts behind them.

The stored trials move: a measured contributor takes its value in another population
that the same parts may come from, at the same unit sample. Responses follow by a
quadratic surface of the trials, and each keeps its remainder.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from tolstat.arrays import Array, Truths
from tolstat.statistics.estimate import Estimate, Lack, NoInterval
from tolstat.statistics.intervals.weights import effective_number
from tolstat.statistics.limits.limit import Limit, margins
from tolstat.statistics.limits.yields import JOINT, PartsUncertainty
from tolstat.statistics.measured.populations import (
    LEAST_PARTS,
    MeasuredSample,
    Population,
)
from tolstat.statistics.remedies.surface import (
    NONLINEAR,
    REMAINDER,
    UNEXPLAINED,
    fitted_surface,
)
from tolstat.statistics.summary import ENDS, MovedNumbers, ResponseUncertainty

DRAWS, DRAWS_OF_MORE = 400, 100
MOST_TRIALS, TRIALS_OF_MORE, TRIALS_OF_NUMBERS = 100_000, 20_000, 4096
MORE_PARTS = (10, 20, 30, 50, 100, 200, 300, 500, 1000)  # that might be measured


class MeasuredTrials(NamedTuple):
    """Trials with measured contributors, SI.

    Attributes
    ----------
    samples : tuple of MeasuredSample
        The measured parts.
    deviations, responses : dict of str to float64[trial]
        Of trials that are done: contributors that deviate, and responses.
    limits : dict of str to Limit
        By response.
    weights : float64[trial] or None
        Of these trials.
    failed : float
        Failed trials, or their weight: out of all limits.
    """

    samples: tuple[MeasuredSample, ...]
    deviations: Mapping[str, Array]
    responses: Mapping[str, Array]
    limits: Mapping[str, Limit]
    weights: Array | None = None
    failed: float = 0.0

    def thinned(self, most: int) -> "MeasuredTrials":
        """Return so many of the trials at most."""
        (trials,) = {len(values) for values in self.responses.values()}
        if trials <= most:
            return self
        chosen = slice(None, None, -(-trials // most))
        deviations, responses = (
            {name: values[chosen] for name, values in columns.items()}
            for columns in (self.deviations, self.responses)
        )
        weights = None if self.weights is None else self.weights[chosen]
        part = len(range(*chosen.indices(trials))) / trials
        return MeasuredTrials(
            self.samples, deviations, responses, self.limits, weights,
            part * self.failed,
        )  # fmt: skip


def uncertainties_of(
    trials: MeasuredTrials, shares: Sequence[float], more: Sequence[int] = MORE_PARTS
) -> dict[str, ResponseUncertainty]:
    """Return how uncertain each response is by the measured parts; `JOINT`: all limits.

    `shares` are those of quantiles, and `more` numbers of parts that may decide.
    """
    entries = {sample.name: sample.parts for sample in trials.samples}
    reason = None
    if any(sample.is_constant for sample in trials.samples):
        reason = NoInterval(Lack.EQUAL_PARTS)
    elif (parts := min(entries.values())) < LEAST_PARTS:
        reason = NoInterval(Lack.PARTS, parts=parts)
    if reason:
        none = Estimate(math.nan, reason=reason)
        uncertainty = PartsUncertainty(entries, "", none, none, (0.0, 1.0))
        names = [*trials.responses, JOINT]
        limited = {*trials.limits, JOINT}
        return {
            n: ResponseUncertainty(uncertainty if n in limited else None, None)
            for n in names
        }
    return _Uncertainties(trials.thinned(MOST_TRIALS), shares, more).by_response()


class _Uncertainties:
    """The uncertainties of all responses, by moving the trials to other populations."""

    def __init__(
        self, trials: MeasuredTrials, shares: Sequence[float], more: Sequence[int]
    ) -> None:
        self.trials, self.shares, self.more = trials, shares, more
        self.movable = _Movable(trials, np.random.default_rng(0))
        fits = {s.fit for s in trials.samples if s.fit_decides}
        self.assumed = " and ".join(sorted(fits))

    def by_response(self) -> dict[str, ResponseUncertainty]:
        samples = self.trials.samples
        deciding = self._drawn(self.movable, DRAWS, samples)
        free = deciding
        if self.assumed:
            free = self._drawn(self.movable, DRAWS, samples, free=True)
        open_limits = [
            name
            for name in self.trials.limits
            if not self._decides(name, deciding, deciding.interval(name)[1:3])
        ]
        needed = self._needed(open_limits) if open_limits else {}
        entries = {sample.name: sample.parts for sample in samples}
        lots = {sample.name: few for sample in samples if (few := sample.few_lots)}
        uncertainties = {}
        for name in (*self.trials.responses, JOINT):
            share = None
            if name in deciding.out:
                interval = deciding.interval(name)
                fitted = interval if self.assumed else Estimate(math.nan)
                share = PartsUncertainty(
                    entries, self.assumed, fitted, free.interval(name),
                    deciding.of_parts(name), needed.get(name, 0), lots,
                )  # fmt: skip
            uncertainties[name] = ResponseUncertainty(share, deciding.numbers.get(name))
        return uncertainties

    def _drawn(
        self,
        movable: "_Movable",
        draws: int,
        samples: Sequence[MeasuredSample],
        *,
        free: bool = False,
        numbers: bool = True,
    ) -> "_Drawn":
        """Return what becomes of the trials in so many draws of the populations.

        The form of a tail is known by a fit alone. Without one, the least share is that
        of populations without tails, however many parts there are.
        """

        def of_populations(
            shares: Sequence[float], *, fits: bool, tails: bool
        ) -> "_Drawn":
            generator = np.random.default_rng(1)
            populations = [
                sample.populations(
                    draws, generator, fitted=sample.fit_decides and fits, tails=tails
                )
                for sample in samples
            ]
            return _Drawn.of(movable, zip(*populations, strict=True), shares)

        shares = self.shares if numbers else ()
        drawn = of_populations(shares, fits=not free, tails=True)
        if not free and all(sample.fit_decides for sample in samples):
            return drawn
        return drawn.from_least_of(of_populations((), fits=False, tails=False))

    def _decides(self, name: str, drawn: "_Drawn", ends: Sequence[float]) -> bool:
        """Tell whether an interval decides, on the side of the trials as they are."""
        permitted, (lower, upper) = 1 - self.trials.limits[name].demanded, ends
        return (
            lower > permitted if drawn.stored[name] > permitted else upper <= permitted
        )

    def _needed(self, names: Sequence[str]) -> dict[str, int]:
        """Return how many measured parts, or lots, would decide limits."""
        trials, needed = self.trials.thinned(TRIALS_OF_MORE), dict[str, int]()
        movable = _Movable(trials, np.random.default_rng(0))
        for number in self.more:
            many = [(x.few_lots or x.parts) >= number for x in trials.samples]
            if all(many):
                continue
            samples = [
                sample if enough else sample.enlarged(number)
                for sample, enough in zip(trials.samples, many, strict=True)
            ]
            drawn = self._drawn(movable, DRAWS_OF_MORE, samples, numbers=False)
            open_limits = [name for name in names if name not in needed]
            needed |= {
                n: number
                for n in open_limits
                if self._decides(n, drawn, drawn.of_parts(n))
            }
            if len(needed) == len(names):
                break
        return needed


class _Movable:
    """Trials whose measured contributors may come from other populations."""

    def __init__(self, trials: MeasuredTrials, generator: np.random.Generator) -> None:
        self.trials, self.names = trials, [*trials.responses]
        self.responses = np.column_stack([trials.responses[n] for n in self.names])
        contributors = [*trials.deviations]
        x = np.column_stack([trials.deviations[n] for n in contributors])
        centre, self.scale = x.mean(axis=0), x.std(axis=0)
        self.z = (x - centre) / self.scale
        surface = fitted_surface(self.z, self.responses)
        poor = surface.remainders > UNEXPLAINED * self.responses.std(axis=0)
        self.remainders = np.where(poor, surface.remainders, 0.0)
        self.measured = [  # which sample, and which column
            (number, contributors.index(name))
            for number, sample in enumerate(trials.samples)
            for name in sample.contributors
            if name in trials.deviations
        ]
        self.columns = np.array([column for _, column in self.measured], np.int64)
        self.x = x[:, self.columns]
        self.units = [
            trials.samples[number].unit_samples(x[:, column], generator)
            for number, column in self.measured
        ]
        self.gains = surface.along(self.z, self.columns)

    def moved(self, populations: Sequence[Population]) -> tuple[Array, Array]:
        """Return responses in other populations, and how far they may be wrong."""
        values = [
            populations[number](units)
            for (number, _), units in zip(self.measured, self.units, strict=True)
        ]
        step = (np.column_stack(values) - self.x) / self.scale[self.columns]
        linear, bent = self.gains(step)
        error = np.zeros(linear.shape[1:])
        if self.remainders.any():  # a surface that explains little may mislead
            after = self.z[:, self.columns] + step
            shift = np.abs(step.mean(axis=0)).sum()
            size = min(1.0, float(shift + np.abs(1 - after.std(axis=0)).sum()))
            error = REMAINDER * size * self.remainders
            error = error + NONLINEAR * np.abs(bent) * (self.remainders > 0)
        return self.responses + linear + bent, error


@dataclass(frozen=True)
class _Drawn:
    """Shares out of limit and numbers, by draw."""

    # by limit: at least and at most, float64[draw, 2]
    out: Mapping[str, Array]
    stored: Mapping[str, float]  # shares of the trials as they are
    number: float  # of trials, or the effective sample size
    numbers: Mapping[str, MovedNumbers]

    @classmethod
    def of(
        cls,
        movable: _Movable,
        draws: Iterator[Sequence[Population]],
        shares: Sequence[float],
    ) -> "_Drawn":
        trials, names = movable.trials, movable.names
        columns = {name: names.index(name) for name in trials.limits}
        counted = _Counted(trials)
        out: dict[str, list[tuple[float, float]]] = {n: [] for n in (*columns, JOINT)}
        few = slice(None, None, -(-len(movable.responses) // TRIALS_OF_NUMBERS))
        weighted = trials.weights is not None
        numbers = [_numbers(movable.responses[few], shares)]
        for populations in draws:
            moved, error = movable.moved(populations)
            out_of_limit = {
                name: _out(moved[:, j], error[..., j], trials.limits[name])
                for name, j in columns.items()
            }
            if columns:
                out_of_limit[JOINT] = np.any([*out_of_limit.values()], axis=0)
            for name, (least, most) in out_of_limit.items():
                out[name].append((counted.share(least), counted.share(most)))
            if shares and not weighted:
                numbers.append(_numbers(moved[few], shares))
        stored = {
            name: counted.share(
                _out(movable.responses[:, j], np.zeros(()), trials.limits[name])[0]
            )
            for name, j in columns.items()
        }
        gains = np.array(numbers[1:]) - numbers[0] if numbers[1:] else None
        moved_numbers = {} if gains is None else {
            name: MovedNumbers(
                gains[:, 0, j], gains[:, 1, j],
                {share: gains[:, 2 + i, j] for i, share in enumerate(shares)},
            )
            for j, name in enumerate(names)
        }  # fmt: skip
        return cls(
            {n: np.array(x) for n, x in out.items() if x}, stored, counted.number,
            moved_numbers,
        )  # fmt: skip

    def from_least_of(self, other: "_Drawn") -> "_Drawn":
        """Return the same with the least shares of others, where these are less."""
        out = {}
        for name, shares in self.out.items():
            least = np.sort(shares[:, 0]), np.sort(other.out[name][:, 0])
            out[name] = np.column_stack([np.minimum(*least), shares[:, 1]])
        return replace(self, out=out)

    def of_parts(self, name: str) -> tuple[float, float]:
        """Return the ends of a share, by the parts alone."""
        (least, most), (lower, upper) = self.out[name].T, ENDS
        return _quantile(least, lower), _quantile(most, upper)

    def interval(self, name: str) -> Estimate:
        """Return the interval of a share, with the error of the trials."""
        generator, (lower, upper) = np.random.default_rng(2), ENDS
        counts = self.number * self.out[name].T
        least, most = generator.beta(counts + 0.5, self.number - counts + 0.5)
        least[counts[0] <= 0], most[counts[1] >= self.number] = 0.0, 1.0
        ends = _quantile(least, lower), _quantile(most, upper)
        return Estimate(self.stored.get(name, math.nan), *ends)


def _quantile(draws: Array, share: float) -> float:
    """Return a quantile; the chance that the next draw exceeds it is the rest."""
    return float(np.quantile(draws, share, method="weibull"))


class _Counted:
    """Shares of weighted trials, failed ones included."""

    def __init__(self, trials: MeasuredTrials) -> None:
        (n,) = {len(values) for values in trials.responses.values()}
        weights = np.ones(n) if trials.weights is None else trials.weights
        self.weights, self.failed = weights, trials.failed
        self.total = float(weights.sum()) + trials.failed
        self.number = n + trials.failed
        if trials.weights is not None:
            self.number = float(effective_number(weights))

    def share(self, flags: Truths) -> float:
        """Return the share of flagged trials, failed ones among them."""
        return (float(self.weights[flags].sum()) + self.failed) / self.total


def _out(values: Array, error: Array, limit: Limit) -> Truths:
    """Return which trials are out of limit, at least and at most: bool[2, trial]."""
    margin = margins(values, limit.permitted)
    return np.array([margin < -error, margin < error])


def _numbers(values: Array, shares: Sequence[float]) -> Array:
    """Return mean, sigma and quantiles, float64[number, response]."""
    if not shares:
        return np.zeros((0, values.shape[1]))
    moments = values.mean(axis=0), values.std(axis=0, ddof=1)
    return np.vstack([*moments, np.quantile(values, shares, axis=0)])
