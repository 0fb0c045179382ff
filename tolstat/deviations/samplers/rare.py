"""Machines beyond a limit that few are beyond: sought in stages, then weighted."""

from __future__ import annotations

import math
from collections.abc import Generator, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, ndtri

from tolstat.deviations.mixture import Mixture, centred, fitted
from tolstat.deviations.streams import random_bits, unit_samples_of

Array = NDArray[np.float64]

SPREADS = np.array([1.5, 2.0, 3.0, 4.0])  # of the first stage, in normal scores
FIRST, EACH, SEEKING = 8, 40, 2  # parts of the trials: first stage, a later one, all
LEAST = 30  # machines beyond; with fewer, those nearest to the limit lead on
WORTH, FOR_EACH = 30, 12  # independent points that a fit rests on, for each direction
MOST_OF_STAGE = 3 / 8  # points that a fit rests on, per trial of a stage
STAGES, FOR_STAGE = 7, 2  # that find their way; directions for each, of many
TWICE = 4  # stages at the spread of the study itself, before the last
POINTS = 400  # that a fit is made to
PLAIN, WIDE = 0.1, 0.05  # shares of the last stage: as the study, twice as wide
LEAST_UNIT = 2.0**-53


class Stage(NamedTuple):
    """Trials that are drawn at once.

    Attributes
    ----------
    unit : float64[trial, stream]
        Independent unit samples of machines.
    spread : float64[trial]
        Times the spread of the study that was aimed at.
    distance : float64[trial]
        From the middle machine, in normal scores: the likelier the nearer.
    weight : float64[trial]
        Density of each as the study has it over that as it was drawn; NaN where
        machines were only sought.
    """

    unit: Array
    spread: Array
    distance: Array
    weight: Array


class Rare:
    """Importance sampling from a mixture that earlier stages have found.

    In the space of independent normal scores. The first stage draws with 1.5 to 4 times
    the spread, so that whatever lies within some ten sigmas in a few directions is met
    whatever the response does before. Each further stage draws from a mixture of
    normal distributions, fitted to the machines beyond of all stages, weighted as with
    a spread that becomes less until it is that of the study. The last stage, half of
    the trials at least, is drawn from the last fit, with a tenth as the study has it
    and a twentieth twice as wide: independent trials with weights, and only these tell
    the share. Where hardly any machine is beyond, those nearest to the limit lead on.

    Of a region that the last stage has not met nothing is known but what its tenth
    says: the stages before may have met it, and lost it among many directions. A draw
    depends on the seed, the number of trials, the names and all answers before.

    References
    ----------
    N. Kurtz, J. Song, Cross-entropy-based adaptive importance sampling using Gaussian
    mixture, Structural Safety 42 (2013) 35-44. J.-M. Cornuet et al., Adaptive multiple
    importance sampling, Scand. J. Statist. 39 (2012) 798-812. K. Breitung, The geometry
    of limit state function graphs and subset simulation: counterexamples, Reliability
    Engineering and System Safety 182 (2019) 98-106: why it is not the response that
    leads to the machines beyond, where it can be helped.
    """

    replicates = 0
    extensible = False
    promise = (
        "machines beyond the limit were sought in stages; the last stage, independent "
        "weighted trials, tells the share beyond, with a gamma interval"
    )

    def group(self, factors: int) -> int:
        """Return how many trials belong together; see `Sampler`."""
        return 1

    def stages(
        self, seed: int, streams: Mapping[str, int], trials: int
    ) -> Generator[Stage, Array, None]:
        """Draw stage by stage.

        Parameters
        ----------
        seed, streams, trials
            As of `Sampler.unit_samples`.

        Yields
        ------
        Stage
            For each it wants float64[trial]: how far the response lies within the
            limit, less than 0 beyond; minus infinity of failed machines.
        """
        seeking = _Seeking(seed, streams)
        mixture = centred(SPREADS, len(streams))
        yield from seeking.stage(mixture, trials // FIRST, 0.0)
        at_one, each = 0, stage_of(trials, len(streams))
        while seeking.trials + each <= trials // SEEKING:
            mixture, spread = seeking.fit(each)
            at_one += spread == 1
            if at_one > TWICE:
                break
            wide = centred(np.array([max(spread, SPREADS[0])]), len(streams))
            yield from seeking.stage(mixture.beside(PLAIN, wide), each, spread)
        plain, wide = (centred(np.array([s]), len(streams)) for s in (1.0, 2.0))
        if seeking.any_beyond:
            mixture, _ = seeking.fit(each)
            mixture = mixture.beside(WIDE, wide).beside(PLAIN, plain)
        else:
            mixture = plain
        yield from seeking.stage(mixture, trials - seeking.trials, 1.0, last=True)


def stage_of(trials: int, directions: int) -> int:
    """Return how many trials a stage has: as many as a fit wants, if they are enough.

    Parameters
    ----------
    trials : int
        Of all stages.
    directions : int
        That deviate independently.
    """
    enough = trials >= safe_trials(directions)
    return max(trials // EACH, _whole_stage(directions) if enough else 0)


def safe_trials(directions: int) -> int:
    """Return with how many trials a fit may rest on all the points that it wants.

    With fewer, of several kinds of machines beyond a smaller one may be lost.
    """
    whole, many = _whole_stage(directions), max(STAGES, directions // FOR_STAGE)
    return min(EACH * whole, math.ceil(many * whole / (1 / SEEKING - 1 / FIRST)))


def _whole_stage(directions: int) -> int:
    return math.ceil(_points_wanted(directions) / MOST_OF_STAGE)


def _points_wanted(directions: int) -> int:
    """Return how many independent points a fit rests on, where a stage has them."""
    return WORTH + FOR_EACH * directions


class _Seeking:
    """The trials of all stages so far, and what the next one is drawn from."""

    def __init__(self, seed: int, streams: Mapping[str, int]) -> None:
        self.seed, self.streams = seed, streams
        self.points = np.empty((0, len(streams)))
        self.margins = np.empty(0)
        self.counts: list[int] = []
        self.mixtures: list[Mixture] = []
        self.logs: list[Array] = []  # of each mixture, the density of every point

    @property
    def trials(self) -> int:
        return len(self.points)

    @property
    def any_beyond(self) -> bool:
        return bool(np.any(self.margins < 0))

    def stage(
        self, mixture: Mixture, trials: int, spread: float, *, last: bool = False
    ) -> Generator[Stage, Array, None]:
        """Draw a stage, and keep what is answered."""
        purpose = f"rare {len(self.counts)}"
        which = unit_samples_of(random_bits(self.seed, "stage", trials, purpose))
        scores = np.empty((trials, len(self.streams)))
        for column, name in enumerate(self.streams):
            bits = random_bits(self.seed, name, trials, purpose)
            scores[:, column] = ndtri(unit_samples_of(bits))
        points = mixture.points(which, scores)
        squares = np.einsum("ni,ni->n", points, points)
        weight = np.full(trials, np.nan)
        if last:
            weight = np.exp(_log_normal(squares, 1.0, points.shape[1])
                            - mixture.log_density(points))  # fmt: skip
        unit = np.clip(np.asarray(ndtr(points)), LEAST_UNIT, 1 - LEAST_UNIT)
        spreads = np.full(trials, spread)
        if not self.counts:
            spreads = SPREADS[mixture.parts(which)]
        margins = yield Stage(unit, spreads, np.sqrt(squares), weight)
        if last:
            return  # nothing is fitted any more
        self.logs = [
            np.append(log, before.log_density(points))
            for log, before in zip(self.logs, self.mixtures, strict=True)
        ]
        self.points = np.concatenate([self.points, points])
        self.margins = np.append(self.margins, margins)
        self.counts.append(trials)
        self.mixtures.append(mixture)
        self.logs.append(mixture.log_density(self.points))

    def fit(self, trials: int) -> tuple[Mixture, float]:
        """Fit a mixture to the machines beyond; return the spread that it is for.

        With fewer points a region that has one of ten machines beyond is lost among
        many directions; with more, of what a stage draws, the spread stays wide.
        """
        inside = self.margins < 0
        if np.count_nonzero(inside) < LEAST:
            inside = self.margins <= np.sort(self.margins)[LEAST - 1]
        points = self.points[inside]
        shares = np.array(self.counts) / self.trials
        logs = np.array(self.logs)[:, inside] + np.log(shares)[:, None]
        drawn = np.logaddexp.reduce(logs)
        squares = np.einsum("ni,ni->n", points, points)
        spreads = np.geomspace(1.0, SPREADS[-1], 60)
        weights = np.array(
            [_log_normal(squares, s, points.shape[1]) - drawn for s in spreads]
        )
        weights = np.exp(weights - weights.max(axis=1, keepdims=True))
        effective = weights.sum(axis=1) ** 2 / np.sum(weights**2, axis=1)
        wanted = min(
            effective.max() / 2,
            _points_wanted(points.shape[1]),
            MOST_OF_STAGE * trials,
        )
        place = int(np.flatnonzero(effective >= wanted)[0])
        # as many points of equal weight: evenly spaced in the sum of the weights
        sums = np.cumsum(weights[place])
        at = (np.arange(POINTS) + 0.5) / POINTS * sums[-1]
        chosen = points[np.searchsorted(sums, at)]
        spread = float(spreads[place])
        return fitted(chosen, float(effective[place]), spread), spread


def _log_normal(squares: Array, spread: float, directions: int) -> Array:
    """Return the logarithm of a centred normal density, at squared distances."""
    logs = -0.5 * squares / spread**2 - directions * np.log(spread)
    return np.asarray(logs - 0.5 * directions * np.log(2 * np.pi), np.float64)
