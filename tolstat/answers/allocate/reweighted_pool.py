"""Trials with several sets of tolerances, weighted for any other set."""

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property, lru_cache, partial
from typing import NamedTuple

import numpy as np
from scipy.special import ndtr

from tolstat.answers.allocate.optimizer import Choice
from tolstat.arrays import Array, Truths
from tolstat.deviations.density_ratio import FARTHEST, DensityRatio
from tolstat.deviations.dependence import Dependence, dependent_groups, equal_parts
from tolstat.deviations.distributions import Constant, Distribution
from tolstat.statistics.intervals.shares import gamma_ends
from tolstat.study.cost_entry import Priced
from tolstat.study.shift_entry import distributions_of
from tolstat.study.study import Study

MISS = 0.025  # chance that a fraction is above the upper end of its interval
OTHERS = 1024  # trials of a run within all limits that the search looks at
NODES, TOLERANCES = 2049, 100  # between which weights are interpolated
KEPT = 12  # weights of a block that are not computed again

Weighting = Callable[[Choice], Array]


class Pool:
    """All trials that were evaluated for an allocation.

    A trial is weighted by the density of the requested tolerances over the mean of
    those it may have been sampled with, each as often as it was (A. Owen, Y. Zhou, Safe
    and effective importance sampling, J. Amer. Stat. Assoc. 95 (2000) 135-143): no
    weight is larger than the fraction of trials with tolerances like them permits.
    """

    def __init__(self, study: Study) -> None:
        self.study = study
        self.trials = 0
        self._sampled: list[tuple[Choice, int]] = []  # how many with which tolerances
        # of those out of limit, and of some within all limits
        self._deviations = {name: np.zeros(0) for name in _loosest(study)}
        self._out = np.zeros((len(study.limits) + 1, 0), np.bool_)  # the last: of any
        self._times = np.zeros(0)  # how many each stands for
        self._weights = _Weights(study, self._deviations, self._sampled)

    def add(self, choice: Choice, seed: int, out_of_limit: Truths) -> None:
        """Take the trials of a run; deviations are sampled again rather than stored."""
        trials = out_of_limit.shape[1]
        study = with_choice(self.study, choice, seed, trials)
        names = [each.name for each in study.description.contributors]
        sampled = study.deviations()
        out, step = np.asarray(out_of_limit.any(axis=0)), max(trials // OTHERS, 1)
        kept = out.copy()
        kept[::step] = True
        self._deviations = {
            name: np.hstack([before, sampled[kept, names.index(name)]])
            for name, before in self._deviations.items()
        }
        every = np.vstack([out_of_limit, out])
        self._out = np.hstack([self._out, every[:, kept]])
        self._times = np.hstack([self._times, np.where(out, 1.0, float(step))[kept]])
        self._sampled.append((choice, trials))
        self.trials += trials
        self._weights = _Weights(self.study, self._deviations, self._sampled)

    def upper_ends(
        self, choice: Choice, miss: float = MISS, *, exact: bool = False
    ) -> Array:
        """Return upper ends of fractions out of limit: float64[limit + 1], any last.

        As of `weighted_share`, but the next trial out of limit has the usual weight,
        not the largest: the result is smooth in the choice, for the search. A fraction
        is larger with the chance `miss`. Exact weights are computed instead of
        interpolated, which takes longer.
        """
        weights = self._weights.of(choice, exact=exact) / self.trials
        counted = weights * self._times
        total = counted.sum()  # 0 where no trial is like it
        usual = float((counted * weights).sum() / total) if total else 1.0
        return np.array(
            [gamma_ends(weights[of], usual, 1 - 2 * miss)[1] for of in self._out]
        )


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
    found: list[_Block] = []
    for i, each in enumerate(study.deviating.priced):
        own = list(each.specified)
        joints = dependent_groups(own, dependence)
        joints += [equal_parts(name, dependence) for name in own]
        names = frozenset(name for joint in joints for name in joint)
        joined = [block for block in found if block.names & names]
        found = [block for block in found if block not in joined]
        found.append(
            _Block(
                tuple(sorted(sum((block.entries for block in joined), (i,)))),
                names.union(*(block.names for block in joined)),
                not joined and all(len(joint) == 1 for joint in joints),
            )
        )
    return found


class _Weights:
    """Weights of trials with these deviations, which were sampled with some choices."""

    def __init__(
        self,
        study: Study,
        deviations: Mapping[str, Array],
        sampled: Sequence[tuple[Choice, int]],
    ) -> None:
        self._study, self._deviations, self._sampled = study, deviations, sampled
        self._priced = study.deviating.priced
        # densities are over that of the loosest tolerances, which the mixture contains:
        # where that is negligible, any other number would do
        self._ratio = DensityRatio(
            deviations, _loosest(study), study.deviating.dependence
        )
        self._mixtures: dict[bool, Array] = {}

    @cached_property
    def _by_block(self) -> list[tuple[tuple[int, ...], Weighting]]:
        """Weights of each block, by its entries: the tables are large."""
        return [
            (block.entries, lru_cache(KEPT)(self._of_block(block)))
            for block in _blocks(self._study)
        ]

    def of(self, choice: Choice, *, exact: bool) -> Array:
        """Return the density of each with a choice over that of the pool.

        Exact ones are computed without tables, which blur the end of a zone.
        """
        over_loosest = self._exact if exact else self._interpolated
        if exact not in self._mixtures:
            trials = sum(n for _, n in self._sampled)
            parts = (n / trials * over_loosest(each) for each, n in self._sampled)
            self._mixtures[exact] = np.asarray(sum(parts))
        found: Array = over_loosest(choice) / self._mixtures[exact]
        return found

    def _interpolated(self, choice: Choice) -> Array:
        """Return the densities over those of the loosest, block by block."""
        each = (of(tuple(choice[i] for i in block)) for block, of in self._by_block)
        return np.asarray(math.prod(each))

    def _exact(self, choice: Choice) -> Array:
        """Return them of all entries at once."""
        return self._of_entries(range(len(choice)), choice)

    def _of_entries(self, entries: Sequence[int], own: Choice) -> Array:
        """Return the densities of some entries over those of the loosest."""
        new = distributions_of([self._priced[i] for i in entries], own)
        return self._ratio.weights(new)

    def _of_block(self, block: _Block) -> Weighting:
        """Return the function that weights a block, from a table if possible."""
        priced = self._priced[block.entries[0]]
        if block.alone and priced.law:
            return _Table(priced, self._deviations).weights
        return partial(self._of_entries, block.entries)


def _loosest(study: Study) -> dict[str, Distribution]:
    """Return what deviates, with the loosest tolerances."""
    priced = study.deviating.priced
    ends = [each.ends[1] for each in priced]
    every = study.deviating.distributions | distributions_of(priced, ends)
    return {n: each for n, each in every.items() if not isinstance(each, Constant)}


class _Table:
    """Interpolated weights of parts of one tolerance that correlate with nothing.

    Right to half a hundredth, except at the end of a zone.
    """

    def __init__(self, entry: Priced, deviations: Mapping[str, Array]) -> None:
        self._entry = entry
        loosest = entry.distributions(entry.ends[1])
        self._name = next(iter(loosest))
        of = loosest[self._name]
        scores = np.linspace(-FARTHEST, FARTHEST, NODES)
        at = of.deviations(np.asarray(ndtr(scores), np.float64))
        self._weighting = DensityRatio({self._name: at}, {self._name: of}, Dependence())
        self._at: dict[int, tuple[Array, Array]] = {}
        self._places = []
        for name in loosest:
            place = np.interp(deviations[name], at, np.arange(NODES, dtype=np.float64))
            below = np.minimum(place.astype(np.int64), NODES - 2)
            self._places.append((below, place - below))

    def weights(self, choice: Choice) -> Array:
        """Return the density of all its parts over that with the loosest tolerance."""
        (chosen,) = choice
        tightest, loosest = self._entry.ends
        place = TOLERANCES * (chosen - tightest) / (loosest - tightest)
        first = min(max(int(place), 0), TOLERANCES - 1)
        part = place - first
        (low, log_low), (high, log_high) = self._node(first), self._node(first + 1)
        with np.errstate(invalid="ignore"):
            between = np.exp((1 - part) * log_low + part * log_high)
        # outside one of both zones there is no logarithm
        both = np.isfinite(log_low) & np.isfinite(log_high)
        at = np.where(both, between, (1 - part) * low + part * high)
        step, found = np.diff(at), np.ones(len(self._places[0][0]))
        for below, rest in self._places:
            found *= at[below] + rest * step[below]
        return found

    def _node(self, number: int) -> tuple[Array, Array]:
        """Return weights with one of the tolerances, and their logarithms."""
        if number not in self._at:
            tightest, loosest = self._entry.ends
            chosen = tightest + (loosest - tightest) * number / TOLERANCES
            new = {self._name: self._entry.distributions(chosen)[self._name]}
            found = self._weighting.weights(new)
            with np.errstate(divide="ignore"):
                self._at[number] = found, np.log(found)
        return self._at[number]


def with_choice(study: Study, choice: Choice, seed: int, trials: int) -> Study:
    """Return a study of random trials with the tolerances of a choice."""
    deviating = study.deviating
    new = deviating.distributions | distributions_of(deviating.priced, choice)
    return dataclasses.replace(
        study.at_random(seed, trials),
        deviating=deviating._replace(distributions=new),
    )
