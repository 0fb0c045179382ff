"""Trials with several sets of tolerances, weighted for any other set."""

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from functools import cache, cached_property, lru_cache, partial
from typing import NamedTuple

import numpy as np
from scipy.special import ndtr

from tolstat.answers.allocate.optimizer import Choice
from tolstat.arrays import Array, Truths
from tolstat.deviations.density_ratio import FARTHEST, DensityRatio
from tolstat.deviations.dependence import Dependence, dependent_groups, equal_parts
from tolstat.deviations.distributions import Constant, Distribution
from tolstat.statistics.intervals.shares import gamma_ends
from tolstat.study.cost_entry import Priced, distributions_of
from tolstat.study.study import Study

MISS = 0.025  # chance that a fraction is above the upper end of its interval
OTHERS = 1024  # trials of a run within all limits that the search looks at
NODES, TOLERANCES = 2049, 100  # between which weights are interpolated
CACHED = 12  # weights of a block that are not computed again

Weighting = Callable[[Choice], Array]


class Pool:
    """All trials that were evaluated for an allocation.

    A trial is weighted by the density of the requested tolerances over the mean of
    those it may have been sampled with, each as often as it was (A. Owen, Y. Zhou, Safe
    and effective importance sampling, J. Amer. Stat. Assoc. 95 (2000) 135-143): no
    weight is larger than the fraction of trials with tolerances like them permits.
    """

    def __init__(self, study: Study) -> None:
        self.study, self._priced = study, study.deviating.priced
        self.trials = 0
        self._sampled: list[tuple[Choice, int]] = []  # how many with which tolerances
        self._loosest = _loosest(study)
        # of those out of limit, and of some within all limits
        self._deviations = {name: np.zeros(0) for name in self._loosest}
        self._out = np.zeros((len(study.limits) + 1, 0), np.bool_)  # the last: of any
        self._times = np.zeros(0)  # how many each stands for

    def add(self, choice: Choice, seed: int, out_of_limit: Truths) -> None:
        """Take the trials of a run; deviations are sampled again rather than stored."""
        trials = out_of_limit.shape[1]
        study = with_choice(self.study, choice, seed, trials)
        names = [contributor.name for contributor in study.description.contributors]
        deviations = study.deviations()
        out, step = np.asarray(out_of_limit.any(axis=0)), max(trials // OTHERS, 1)
        rows = np.flatnonzero(out | (np.arange(trials) % step == 0))
        self._deviations = {
            name: np.hstack([before, deviations[rows, names.index(name)]])
            for name, before in self._deviations.items()
        }
        self._out = np.hstack([self._out, np.vstack([out_of_limit, out])[:, rows]])
        self._times = np.hstack([self._times, np.where(out[rows], 1.0, float(step))])
        self._sampled.append((choice, trials))
        self.trials += trials
        for name in ("_ratio", "_mixtures", "_by_block"):  # of fewer trials
            vars(self).pop(name, None)

    def upper_ends(
        self, choice: Choice, miss: float = MISS, *, exact: bool = False
    ) -> Array:
        """Return upper ends of fractions out of limit: float64[limit + 1], any last.

        As of `weighted_share`, but the next trial out of limit has the usual weight,
        not the largest: the result is smooth in the choice, for the search. A fraction
        is larger with the chance `miss`. Exact weights are computed instead of
        interpolated, which takes longer.
        """
        weights = self.weights(choice, exact=exact) / self.trials
        counted = weights * self._times
        total = counted.sum()  # 0 where no trial is like it
        usual = float((counted * weights).sum() / total) if total else 1.0
        return np.array(
            [gamma_ends(weights[out], usual, 1 - 2 * miss)[1] for out in self._out]
        )

    @cached_property
    def _ratio(self) -> DensityRatio:
        """Densities over that of the loosest tolerances, which the mixture contains.

        Where that is negligible, any other number would do.
        """
        dependence = self.study.deviating.dependence
        return DensityRatio(self._deviations, self._loosest, dependence)

    @cached_property
    def _mixtures(self) -> dict[bool, Array]:
        """Densities of the pool over those of the loosest: exact ones, and others."""
        return {}

    @cached_property
    def _by_block(self) -> list[tuple[tuple[int, ...], Weighting]]:
        """Weights of each block, by its entries: the tables are large."""
        weightings: list[tuple[tuple[int, ...], Weighting]] = []
        for block in _blocks(self.study):
            entry = self._priced[block.entries[0]]
            weighting: Weighting = partial(self._exact, entries=block.entries)
            if block.alone and entry.law:
                weighting = _Table(entry, self._deviations).weights
            weightings.append((block.entries, lru_cache(CACHED)(weighting)))
        return weightings

    def weights(self, choice: Choice, *, exact: bool) -> Array:
        """Return the density of each with a choice over that of the pool.

        Exact ones are computed without tables, which blur the end of a zone.
        """
        over_loosest = self._exact if exact else self._interpolated
        if exact not in self._mixtures:
            parts = (
                n / self.trials * over_loosest(other) for other, n in self._sampled
            )
            self._mixtures[exact] = np.asarray(sum(parts))
        return np.asarray(over_loosest(choice) / self._mixtures[exact])

    def _interpolated(self, choice: Choice) -> Array:
        """Return the densities over those of the loosest, block by block."""
        factors = (
            weighting(tuple(choice[i] for i in entries))
            for entries, weighting in self._by_block
        )
        return np.asarray(math.prod(factors))

    def _exact(self, choice: Choice, entries: Sequence[int] | None = None) -> Array:
        """Return the densities of some entries, or all, over those of the loosest."""
        numbers = range(len(choice)) if entries is None else entries
        new = distributions_of([self._priced[i] for i in numbers], choice)
        return self._ratio.weights(new)


class _Block(NamedTuple):
    """Correlated entries, by number, or a tolerance and its shift.

    Weights are a product over the blocks.
    """

    entries: tuple[int, ...]
    names: frozenset[str]  # their contributors, and those correlated with these
    alone: bool  # no correlation, not even of their own parts with each other


def _blocks(study: Study) -> list[_Block]:
    """Return the entries in blocks that are independent of each other."""
    dependence = study.deviating.dependence
    blocks: list[_Block] = []
    for i, entry in enumerate(study.deviating.priced):
        parts = list(entry.specified)
        joints = dependent_groups(parts, dependence)
        joints += [equal_parts(name, dependence) for name in parts]
        names = frozenset(name for joint in joints for name in joint)
        joined = [block for block in blocks if block.names & names]
        entries = tuple(sorted(sum((block.entries for block in joined), (i,))))
        names = names.union(*(block.names for block in joined))
        alone = not joined and all(len(joint) == 1 for joint in joints)
        blocks = [block for block in blocks if block not in joined]
        blocks.append(_Block(entries, names, alone))
    return blocks


def _loosest(study: Study) -> dict[str, Distribution]:
    """Return what deviates, with the loosest tolerances."""
    priced = study.deviating.priced
    ends = [entry.ends[1] for entry in priced]
    distributions = study.deviating.distributions | distributions_of(priced, ends)
    return {n: d for n, d in distributions.items() if not isinstance(d, Constant)}


class _Table:
    """Interpolated weights of parts of one tolerance that correlate with nothing.

    Right to half a hundredth, except at the end of a zone.
    """

    def __init__(self, entry: Priced, deviations: Mapping[str, Array]) -> None:
        self._entry = entry
        loosest = entry.distributions(entry.ends[1])
        self._name = next(iter(loosest))
        widest = {self._name: loosest[self._name]}
        scores = np.linspace(-FARTHEST, FARTHEST, NODES)
        nodes = widest[self._name].deviations(np.asarray(ndtr(scores), np.float64))
        self._ratio = DensityRatio({self._name: nodes}, widest, Dependence())
        self._column = cache(self._weights_at)
        self._positions = []
        for name in loosest:
            position = np.interp(deviations[name], nodes, np.arange(float(NODES)))
            below = np.minimum(position.astype(np.int64), NODES - 2)
            self._positions.append((below, position - below))

    def weights(self, choice: Choice) -> Array:
        """Return the density of all its parts over that with the loosest tolerance."""
        (chosen,) = choice
        tightest, loosest = self._entry.ends
        position = TOLERANCES * (chosen - tightest) / (loosest - tightest)
        first = min(max(int(position), 0), TOLERANCES - 1)
        part = position - first
        (low, log_low), (high, log_high) = self._column(first), self._column(first + 1)
        with np.errstate(invalid="ignore"):
            between = np.exp((1 - part) * log_low + part * log_high)
        # outside one of both zones there is no logarithm
        both = np.isfinite(log_low) & np.isfinite(log_high)
        column = np.where(both, between, (1 - part) * low + part * high)
        step, weights = np.diff(column), np.ones(len(self._positions[0][0]))
        for below, rest in self._positions:
            weights *= column[below] + rest * step[below]
        return weights

    def _weights_at(self, number: int) -> tuple[Array, Array]:
        """Return weights with one of the tolerances, and their logarithms."""
        tightest, loosest = self._entry.ends
        chosen = tightest + (loosest - tightest) * number / TOLERANCES
        new = {self._name: self._entry.distributions(chosen)[self._name]}
        weights = self._ratio.weights(new)
        with np.errstate(divide="ignore"):
            return weights, np.log(weights)


def with_choice(study: Study, choice: Choice, seed: int, trials: int) -> Study:
    """Return a study of random trials with the tolerances of a choice."""
    deviating = study.deviating
    new = deviating.distributions | distributions_of(deviating.priced, choice)
    return dataclasses.replace(
        study.at_random(seed, trials),
        deviating=dataclasses.replace(deviating, distributions=new),
    )
