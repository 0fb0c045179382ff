"""Trials with several sets of tolerances, weighted for any other set."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property, lru_cache, partial

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

Weighting = Callable[[Choice], Array]


class Pool:
    """All trials that were evaluated for an allocation.

    A trial is weighted by the density of the requested tolerances over the mean of
    those it may have been sampled with, each as often as it was (A. Owen, Y. Zhou, Safe
    and effective importance sampling, J. Amer. Stat. Assoc. 95 (2000) 135-143): no
    weight is larger than the fraction of trials with tolerances like them permits.
    """

    def __init__(self, study: Study) -> None:
        self.study, self.priced = study, study.deviating.priced
        self.trials = 0
        self._sampled: list[tuple[Choice, int]] = []  # how many with which tolerances
        # of those out of limit, and of some within all limits
        self._deviations = dict[str, Array]()
        self._out = np.zeros((len(study.limits) + 1, 0), np.bool_)  # the last: of any
        self._times = np.zeros(0)  # how many each stands for

    def add(self, choice: Choice, seed: int, out_of_limit: Truths) -> None:
        """Take the trials of a run; deviations are sampled again rather than stored."""
        trials = out_of_limit.shape[1]
        study = with_choice(self.study, choice, seed, trials)
        names = [each.name for each in study.description.contributors]
        sampled, before = study.deviations(), self._deviations
        out, step = np.asarray(out_of_limit.any(axis=0)), max(trials // OTHERS, 1)
        kept = out.copy()
        kept[::step] = True
        self._deviations = {
            name: np.hstack([before.get(name, ()), sampled[kept, names.index(name)]])
            for name, each in study.deviating.distributions.items()
            if not isinstance(each, Constant)
        }
        every = np.vstack([out_of_limit, out])
        self._out = np.hstack([self._out, every[:, kept]])
        self._times = np.hstack([self._times, np.where(out, 1.0, float(step))[kept]])
        self._sampled.append((choice, trials))
        self.trials += trials
        # densities are over that of the loosest tolerances, which the mixture contains:
        # where that is negligible, any other number would do
        ends = [each.ends[1] for each in self.priced]
        loosest = study.deviating.distributions | distributions_of(self.priced, ends)
        self._ratio = DensityRatio(
            self._deviations,
            {name: loosest[name] for name in self._deviations},
            study.deviating.dependence,
        )
        self._mixtures = dict[bool, Array]()
        vars(self).pop("_blocks", None)

    @cached_property
    def _blocks(self) -> list[tuple[list[int], Weighting]]:
        return [
            (entries, lru_cache(KEPT)(self._weights_of(entries, alone)))
            for entries, _, alone in _blocks(self.study)
        ]

    def upper_ends(
        self, choice: Choice, miss: float = MISS, *, exact: bool = False
    ) -> Array:
        """Return upper ends of fractions out of limit: float64[limit + 1], any last.

        As of `weighted_share`, but the next trial out of limit has the usual weight,
        not the largest: the result is smooth in the choice, for the search. A fraction
        is larger with the chance `miss`. Exact weights are computed instead of
        interpolated, which takes longer.
        """
        weights = self._weights(choice, exact=exact) / self.trials
        counted = weights * self._times
        total = counted.sum()  # 0 where no trial is like it
        usual = float((counted * weights).sum() / total) if total else 1.0
        return np.array(
            [gamma_ends(weights[of], usual, 1 - 2 * miss)[1] for of in self._out]
        )

    def _weights(self, choice: Choice, *, exact: bool = False) -> Array:
        """Return the density of each with a choice over that of the pool.

        Exact ones are computed without tables, which blur the end of a zone.
        """

        def over_loosest(choice: Choice) -> Array:
            if exact:
                return self._of(range(len(choice)), choice)
            found = np.ones(len(self._times))
            for entries, weights in self._blocks:
                found *= weights(tuple(choice[i] for i in entries))
            return found

        if exact not in self._mixtures:
            parts = (n / self.trials * over_loosest(each) for each, n in self._sampled)
            self._mixtures[exact] = np.asarray(sum(parts))
        found: Array = over_loosest(choice) / self._mixtures[exact]
        return found

    def _weights_of(self, entries: Sequence[int], alone: bool) -> Weighting:
        """Return the function that weights a block, from a table if possible."""
        priced = self.priced[entries[0]]
        if alone and priced.law:
            return _Table(priced, self._deviations).weights
        return partial(self._of, entries)

    def _of(self, entries: Sequence[int], own: Choice) -> Array:
        """Return the densities of some entries over those of the loosest."""
        new = distributions_of([self.priced[i] for i in entries], own)
        return self._ratio.weights(new)


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


def _blocks(study: Study) -> list[tuple[list[int], set[str], bool]]:
    """Return the numbers of entries in blocks that are independent of each other.

    Correlated entries, or a tolerance and its shift; with the contributors of a block
    and those correlated with these, and whether nothing in it is correlated.
    """
    dependence = study.deviating.dependence
    found: list[tuple[list[int], set[str], bool]] = []
    for i, each in enumerate(study.deviating.priced):
        own = list(each.specified)
        joints = dependent_groups(own, dependence)
        joints += [equal_parts(name, dependence) for name in own]
        names = {name for joint in joints for name in joint}
        joined = [block for block in found if block[1] & names]
        alone = not joined and all(len(joint) == 1 for joint in joints)
        entries = sorted(sum((block[0] for block in joined), [i]))
        found = [block for block in found if block not in joined]
        found.append((entries, names.union(*(block[1] for block in joined)), alone))
    return found


def with_choice(study: Study, choice: Choice, seed: int, trials: int) -> Study:
    """Return a study of random trials with the tolerances of a choice."""
    deviating = study.deviating
    new = deviating.distributions | distributions_of(deviating.priced, choice)
    return dataclasses.replace(
        study.at_random(seed, trials),
        deviating=deviating._replace(distributions=new),
    )
