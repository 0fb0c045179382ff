"""Trials with several sets of tolerances, weighted for any other set."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache, partial
from typing import NamedTuple

import numpy as np
from scipy.special import ndtr

from tolstat.answers.allocate.optimizer import Choice
from tolstat.arrays import Array, Truths
from tolstat.deviations.density_ratio import (
    FARTHEST,
    DensityRatio,
    dependent_groups,
    equal_parts,
)
from tolstat.deviations.dependence import Dependence
from tolstat.deviations.distributions import Constant
from tolstat.statistics.intervals.shares import gamma_ends
from tolstat.study.cost_entry import Priced
from tolstat.study.shift_entry import distributions_of
from tolstat.study.study import Study

MISS = 0.025  # chance that a fraction is above the upper end of its interval
OTHERS = 1024  # trials of a run within all limits that the search looks at
NODES, TOLERANCES = 2049, 100  # between which weights are interpolated
KEPT = 12  # weights of a block that are not computed again


class _Run(NamedTuple):
    """Trials with one set of tolerances; only some of those within all limits."""

    choice: Choice
    trials: int  # of the run
    deviations: Mapping[str, Array]
    out_of_limit: Truths  # [limit, trial]
    times: Array  # how many each stands for


class Pool:
    """All trials that were evaluated for an allocation.

    A trial is weighted by the density of the requested tolerances over the mean of
    those it may have been sampled with, each as often as it was (A. Owen, Y. Zhou, Safe
    and effective importance sampling, J. Amer. Stat. Assoc. 95 (2000) 135-143): no
    weight is larger than the fraction of trials with tolerances like them permits.
    """

    def __init__(self, study: Study) -> None:
        self.study = study
        self._runs: list[_Run] = []
        self._known: _Rows | None = None

    def add(self, choice: Choice, seed: int, out_of_limit: Truths) -> None:
        """Take the trials of a run; deviations are sampled again rather than stored."""
        trials = out_of_limit.shape[1]
        study = with_choice(self.study, choice, seed, trials)
        names = [each.name for each in study.description.contributors]
        sampled = study.deviations()
        out, step = np.asarray(out_of_limit.any(axis=0)), max(trials // OTHERS, 1)
        kept = out.copy()
        kept[::step] = True
        deviations = {
            name: sampled[kept, names.index(name)]
            for name, each in study.deviating.distributions.items()
            if not isinstance(each, Constant)
        }
        times = np.where(out, 1.0, float(step))[kept]
        run = _Run(choice, trials, deviations, out_of_limit[:, kept], times)
        self._runs.append(run)
        self._known = None

    @property
    def trials(self) -> int:
        """How many trials there are."""
        return sum(each.trials for each in self._runs)

    def upper_ends(
        self, choice: Choice, miss: float = MISS, *, exact: bool = False
    ) -> Array:
        """Return upper ends of fractions out of limit: float64[limit + 1], any last.

        As of `weighted_share`, but the next trial out of limit has the usual weight,
        not the largest: the result is smooth in the choice, for the search. A fraction
        is larger with the chance `miss`. Exact weights are computed instead of
        interpolated, which takes longer.
        """
        rows = self._rows()
        weights = rows.weights(choice, exact=exact) / self.trials
        counted = weights * rows.times
        total = counted.sum()  # 0 where no trial is like it
        usual = float((counted * weights).sum() / total) if total else 1.0
        return np.array(
            [gamma_ends(weights[of], usual, 1 - 2 * miss)[1] for of in rows.every]
        )

    def _rows(self) -> _Rows:
        if self._known is None:
            self._known = _Rows(self.study, self._runs)
        return self._known


class _Rows:
    """Trials of a pool and their weights."""

    def __init__(self, study: Study, runs: Sequence[_Run]) -> None:
        out = np.hstack([each.out_of_limit for each in runs])
        self.every = (*out, out.any(axis=0))
        self.times = np.hstack([each.times for each in runs])
        deviations = {
            name: np.hstack([each.deviations[name] for each in runs])
            for name in runs[0].deviations
        }
        self.priced = study.deviating.priced
        # densities are over that of the loosest tolerances, which the mixture contains:
        # where that is negligible, any other number would do
        ends = [each.ends[1] for each in self.priced]
        loosest = study.deviating.distributions | distributions_of(self.priced, ends)
        self._weighting = DensityRatio(
            deviations,
            {name: loosest[name] for name in deviations},
            study.deviating.dependence,
        )
        self._blocks = [
            (block.entries, lru_cache(KEPT)(self._weights_of(block, deviations)))
            for block in _blocks(study)
        ]
        trials = sum(each.trials for each in runs)
        self._shares = [(each.choice, each.trials / trials) for each in runs]
        self._mixtures: dict[bool, Array] = {}

    def weights(self, choice: Choice, *, exact: bool = False) -> Array:
        """Return the density of each with a choice over that of the pool.

        Exact ones are computed without tables, which blur the end of a zone.
        """

        def over_loosest(choice: Choice) -> Array:
            every = range(len(choice))
            return self._of(every, choice) if exact else self._over_loosest(choice)

        if exact not in self._mixtures:
            parts = (share * over_loosest(each) for each, share in self._shares)
            self._mixtures[exact] = np.asarray(sum(parts))
        found: Array = over_loosest(choice) / self._mixtures[exact]
        return found

    def _over_loosest(self, choice: Choice) -> Array:
        """Return the density with a choice over that of the loosest one."""
        found = np.ones(len(self.times))
        for entries, weights in self._blocks:
            found *= weights(tuple(choice[i] for i in entries))
        return found

    def _weights_of(
        self, block: _Block, deviations: Mapping[str, Array]
    ) -> Callable[[Choice], Array]:
        """Return the function that weights a block, from a table if possible."""
        priced = self.priced[block.entries[0]]
        if block.alone and priced.law:
            return _Table(priced, deviations).weights
        return partial(self._of, block.entries)

    def _of(self, entries: Sequence[int], own: Choice) -> Array:
        """Return the densities of some entries over those of the loosest."""
        new = distributions_of([self.priced[i] for i in entries], own)
        return self._weighting.weights(new)


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


class _Block(NamedTuple):
    """Correlated entries, by number, or a tolerance and its shift.

    Weights are a product over the blocks.
    """

    entries: tuple[int, ...]
    names: frozenset[str]  # their contributors, and those correlated with these
    alone: bool  # no correlation, not even of their own parts with each other


def _blocks(study: Study) -> list[_Block]:
    """Sort entries into blocks that are independent of each other."""
    dependence = study.deviating.dependence
    found: list[_Block] = []
    for i, each in enumerate(study.deviating.priced):
        own = list(each.specified)
        joints = dependent_groups(own, dependence)
        joints += [equal_parts(name, dependence) for name in own]
        names = frozenset(name for joint in joints for name in joint)
        made = _Block((i,), names, all(len(joint) == 1 for joint in joints))
        for block in [block for block in found if block.names & names]:
            found.remove(block)
            made = _Block(
                (*block.entries, *made.entries), made.names | block.names, False
            )
        found.append(made)
    return found


def with_choice(study: Study, choice: Choice, seed: int, trials: int) -> Study:
    """Return a study of random trials with the tolerances of a choice."""
    deviating = study.deviating
    new = deviating.distributions | distributions_of(deviating.priced, choice)
    return dataclasses.replace(
        study.at_random(seed, trials),
        deviating=deviating._replace(distributions=new),
    )
