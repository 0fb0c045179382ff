"""Machines drawn with several sets of tolerances, weighted as one run of any other."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from tolstat.answers.allocate.optimizer import Choice
from tolstat.deviations.density_ratio import (
    FARTHEST,
    DensityRatio,
    dependent_groups,
    equal_parts,
)
from tolstat.deviations.dependence import Dependence
from tolstat.deviations.distributions import Distribution
from tolstat.deviations.distributions.constant import Constant
from tolstat.deviations.prices import Priced
from tolstat.execution.trial_table import Trials
from tolstat.statistics.intervals.gamma_interval import gamma_ends
from tolstat.statistics.limits.limit import Limit, within
from tolstat.study.study import Study

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]

MISS = 0.025  # with which a share may be above the upper end of its interval
OTHERS = 1024  # machines of a run within all limits that the search looks at
NODES, TOLERANCES = 2049, 100  # between which weights are interpolated
KEPT = 12  # weights of a block that are not computed anew


def beyond_each(limits: Mapping[str, Limit], trials: Trials) -> Bools:
    """Tell which machines are beyond a limit, or failed: bool[limit, trial]."""
    return np.array(
        [~within(trials.response(name), of.permitted) for name, of in limits.items()]
    )


class _Drawn(NamedTuple):
    """Machines drawn with one set of tolerances: of those within all limits some."""

    choice: Choice
    trials: int  # how many were drawn
    deviations: Mapping[str, Array]
    beyond: Bools  # [limit, machine]
    times: Array  # how many each stands for


class Pool:
    """All machines that were evaluated for an allocation.

    A machine is weighted by the density of the tolerances asked for over the mean of
    those it may have been drawn from, each as often as it was (A. Owen, Y. Zhou, Safe
    and effective importance sampling, J. Amer. Stat. Assoc. 95 (2000) 135-143): no
    weight is larger than the share of the machines drawn with tolerances like them
    permits.

    Parameters
    ----------
    study : Study
        Whose lines have costs.
    """

    def __init__(self, study: Study) -> None:
        self.study = study
        self._drawn: list[_Drawn] = []
        self._telling: _Rows | None = None

    def add(self, choice: Choice, seed: int, beyond: Bools) -> None:
        """Take machines that were drawn with the tolerances of a choice.

        Parameters
        ----------
        choice : tuple of float
            One of each line that has a cost.
        seed : int
            Of their deviations, which are drawn again: nobody need have kept them.
        beyond : bool[limit, trial]
            Which of them are beyond each limit, or failed.
        """
        study = with_choice(self.study, choice, seed, beyond.shape[1])
        names = [each.name for each in study.description.contributors]
        drawn, trials = study.deviations(), beyond.shape[1]
        telling, step = np.asarray(beyond.any(axis=0)), max(trials // OTHERS, 1)
        kept = telling.copy()
        kept[::step] = True
        deviating = {
            name: drawn[kept, names.index(name)]
            for name, each in study.deviating.distributions.items()
            if not isinstance(each, Constant)
        }
        times = np.where(telling, 1.0, float(step))[kept]
        self._drawn.append(_Drawn(choice, trials, deviating, beyond[:, kept], times))
        self._telling = None

    @property
    def trials(self) -> int:
        """How many machines there are."""
        return sum(each.trials for each in self._drawn)

    def most(self, choice: Choice, miss: float = MISS, *, exact: bool = False) -> Array:
        """Return what the shares beyond hardly exceed: float64[limit + 1], any last.

        The upper end of `weighted_share`, but that the next machine beyond is one of
        the usual weight, and not of the heaviest: smooth in what is chosen, and to
        search with; what is found is proved otherwise.

        Parameters
        ----------
        choice : tuple of float
            One of each line that has a cost.
        miss : float
            With which a share may be larger; 0.5: as likely as not.
        exact : bool
            Whether weights are computed, which takes longer, and not interpolated.
        """
        rows = self._rows()
        weights = (rows.exact if exact else rows.weights)(choice) / self.trials
        counted = weights * rows.times
        usual = float((counted * weights).sum() / counted.sum())
        ends = []
        for of in rows.every:
            own = weights[of]
            ends.append(gamma_ends(own, usual, 1 - 2 * miss)[1])
        return np.array(ends)

    def apart(self, choice: Choice, other: Choice) -> tuple[Array, Array]:
        """Estimate by how much the share beyond each limit is more than of another.

        Returns
        -------
        float64[limit], float64[limit]
            The difference, and its standard error.
        """
        rows = self._rows()
        apart = (rows.weights(choice) - rows.weights(other)) / self.trials
        own = [apart[of] for of in rows.every[:-1]]
        return (
            np.array([each.sum() for each in own]),
            np.sqrt([np.sum(each**2) for each in own]),
        )

    def _rows(self) -> _Rows:
        if self._telling is None:
            self._telling = _Rows(self.study, self._drawn)
        return self._telling


class _Rows:
    """Machines of a pool and their weights."""

    def __init__(self, study: Study, drawn: Sequence[_Drawn]) -> None:
        beyond = np.hstack([each.beyond for each in drawn])
        self.every = (*beyond, beyond.any(axis=0))
        self.times = np.hstack([each.times for each in drawn])
        deviations = {
            name: np.hstack([each.deviations[name] for each in drawn])
            for name in drawn[0].deviations
        }
        self.priced = study.deviating.priced
        # what they are compared with is in the mixture as well: where it is next to
        # nothing any other number would do
        beside = dict(study.deviating.distributions)
        for line in self.priced:
            beside.update(line.distributions(line.ends[1]))
        dependence = study.deviating.dependence
        self._weighting = DensityRatio(
            deviations, {name: beside[name] for name in deviations}, dependence
        )
        self._blocks = _blocks(study)
        self._tables = {
            line: _Table(self.priced[line], deviations)
            for block in self._blocks
            for line in block.lines
            if block.alone and self.priced[line].law
        }
        self._known: dict[tuple[int, ...], dict[Choice, Array]] = {}
        trials = sum(each.trials for each in drawn)
        self._drawn = [(each.choice, each.trials / trials) for each in drawn]
        self._mixture = self._mixed(self._over_loosest)
        self._exactly: Array | None = None

    def weights(self, choice: Choice) -> Array:
        """Return the density of each with a choice over that of the pool."""
        found: Array = self._over_loosest(choice) / self._mixture
        return found

    def exact(self, choice: Choice) -> Array:
        """Return the same, without tables, which blur the end of a zone."""
        if self._exactly is None:
            self._exactly = self._mixed(self._computed)
        found: Array = self._computed(choice) / self._exactly
        return found

    def _mixed(self, over_loosest: Callable[[Choice], Array]) -> Array:
        found = np.zeros(len(self.times))
        for choice, share in self._drawn:
            found += share * over_loosest(choice)
        return found

    def _computed(self, choice: Choice) -> Array:
        new: dict[str, Distribution] = {}
        for each, chosen in zip(self.priced, choice, strict=True):
            new.update(each.distributions(chosen))
        return self._weighting.weights(new)

    def _over_loosest(self, choice: Choice) -> Array:
        """Return the density with a choice over that of the loosest one."""
        found = np.ones(len(self.times))
        for block in self._blocks:
            known = self._known.setdefault(block.lines, {})
            own = tuple(choice[i] for i in block.lines)
            if own not in known:
                if len(known) >= KEPT:
                    del known[next(iter(known))]
                known[own] = self._of(block, own)
            found *= known[own]
        return found

    def _of(self, block: _Block, own: Choice) -> Array:
        """Return the densities of one block over those of the loosest."""
        if block.lines[0] in self._tables:
            return self._tables[block.lines[0]].weights(own[0])
        new: dict[str, Distribution] = {}
        for i, chosen in zip(block.lines, own, strict=True):
            new.update(self.priced[i].distributions(chosen))
        return self._weighting.weights(new)


class _Table:
    """Weights of parts of one tolerance that hang together with nothing.

    Between deviations and tolerances for which they are known, of both so many that
    they are right to half a hundredth, but at the end of a zone.
    """

    def __init__(self, line: Priced, deviations: Mapping[str, Array]) -> None:
        self._line = line
        drawn = line.distributions(line.ends[1])
        self._name = next(iter(drawn))
        of = drawn[self._name]
        scores = np.linspace(-FARTHEST, FARTHEST, NODES)
        at = of.deviations(np.asarray(ndtr(scores), np.float64))
        self._weighting = DensityRatio({self._name: at}, {self._name: of}, Dependence())
        self._at: dict[int, tuple[Array, Array]] = {}
        self._places = []
        for name in drawn:
            place = np.interp(deviations[name], at, np.arange(NODES, dtype=np.float64))
            below = np.minimum(place.astype(np.int64), NODES - 2)
            self._places.append((below, place - below))

    def weights(self, chosen: float) -> Array:
        """Return the density of all its parts over that with the loosest tolerance."""
        tightest, loosest = self._line.ends
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
            tightest, loosest = self._line.ends
            chosen = tightest + (loosest - tightest) * number / TOLERANCES
            new = {self._name: self._line.distributions(chosen)[self._name]}
            found = self._weighting.weights(new)
            with np.errstate(divide="ignore"):
                self._at[number] = found, np.log(found)
        return self._at[number]


class _Block(NamedTuple):
    """Lines that hang together, by number; their weights are a product of blocks'.

    Attributes
    ----------
    lines : tuple of int
        Which.
    names : frozenset of str
        Their contributors, and what hangs together with these.
    alone : bool
        Whether nothing does, not even their own parts with each other.
    """

    lines: tuple[int, ...]
    names: frozenset[str]
    alone: bool


def _blocks(study: Study) -> list[_Block]:
    """Sort lines into blocks that nothing connects."""
    dependence = study.deviating.dependence
    found: list[_Block] = []
    for i, each in enumerate(study.deviating.priced):
        own = list(each.drawn)
        joints = dependent_groups(own, dependence)
        joints += [equal_parts(name, dependence) for name in own]
        names = frozenset(name for joint in joints for name in joint)
        made = _Block((i,), names, all(len(joint) == 1 for joint in joints))
        for block in [block for block in found if block.names & names]:
            found.remove(block)
            made = _Block((*block.lines, *made.lines), made.names | block.names, False)
        found.append(made)
    return found


def with_choice(study: Study, choice: Choice, seed: int, trials: int) -> Study:
    """Return a study of random machines with the tolerances of a choice."""
    deviating = study.deviating
    new = dict(deviating.distributions)
    for priced, chosen in zip(deviating.priced, choice, strict=True):
        new.update(priced.distributions(chosen))
    return dataclasses.replace(
        study.at_random(seed, trials),
        deviating=deviating._replace(distributions=new),
    )
