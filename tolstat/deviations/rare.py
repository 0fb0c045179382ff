"""Rare-event sampling: trials out of limit are searched in stages, then weighted."""

import math
from collections.abc import Generator, Mapping
from types import MappingProxyType

import numpy as np

from tolstat.arrays import Array
from tolstat.deviations import rare_stage
from tolstat.deviations.mixture import Mixture, centred, fitted, log_normal
from tolstat.deviations.samplers import Sampler, uniform
from tolstat.deviations.subset_simulation import STEPS, subset_simulation

LEAST_TRIALS, ENOUGH = 5000, 20_000  # least number of a run; a number that is enough
SPREADS = np.array([1.5, 2.0, 3.0, 4.0])  # of the first stage, in normal scores
FIRST, STEP, EACH, SEARCHING = 0.1, 0.02, 0.02, 0.6  # of the trials: see `Rare`
LEAST = 30  # trials out of limit; with fewer, those nearest to it are fitted
MOST_OF_STAGE = 3 / 8  # independent points of a fit, per trial of a stage
WORTH, FOR_EACH = 30, 12  # points that a fit needs; more for each direction
STAGES = 7, 5, 0.5  # that adapt: least number, base, more for each direction
MOST_AT_ONE = 4  # stages at the spread of the study, before the last
POINTS = 400  # of a fit
ADDED, ADDED_SHARE = 10, 0.03  # parts added to the last fits; share of each
PLAIN, WIDE = 0.1, 0.05  # shares of the last stage: as the study, twice as wide
NEAR, NEAR_LAST = 0.2, 0.1  # shares of `near`: in a stage, in the last


class Rare(Sampler):
    """Importance sampling from a mixture that earlier stages have found.

    It works in the space of independent normal scores. Two searches complement each
    other. The first stage, a tenth of the trials, has 1.5 to 4 times the spread; in a
    few directions it reaches ten sigmas. `subset_simulation` follows the response
    towards the limit, in steps of a fiftieth of the trials.

    Each later stage samples from a fitted mixture of normal distributions, a fifth of
    it from subset simulation. The fit uses the out-of-limit trials of all stages but
    subset simulation. Their weights are for a spread that falls to that of the study.
    If hardly any trial is out of limit, the trials nearest to the limit are fitted.

    The last stage has at least two fifths of the trials. It samples from the last fit,
    extended where few points dominate the fraction. A tenth comes from subset
    simulation, a tenth from the study, a twentieth from twice its spread. Only these
    weighted trials estimate the fraction; the tenth as in the study bounds the rest.

    A sample depends on the seed, the number of trials, the names and earlier responses.

    References
    ----------
    N. Kurtz, J. Song, Cross-entropy-based adaptive importance sampling using Gaussian
    mixture, Structural Safety 42 (2013) 35-44. J.-M. Cornuet et al., Adaptive multiple
    importance sampling, Scand. J. Statist. 39 (2012) 798-812. K. Breitung, The geometry
    of limit state function graphs and subset simulation: counterexamples, Reliability
    Engineering and System Safety 182 (2019) 98-106: why the response alone must not
    lead to the trials out of limit.
    """

    sample = False
    aims = True
    columns = MappingProxyType(
        {
            rare_stage.STAGE: "stage that the trial belongs to; NaN before it is drawn",
            rare_stage.SPREAD: "times the spread of the study that the stage aimed at",
            rare_stage.DISTANCE: "distance from the middle trial, in normal scores",
            rare_stage.WEIGHT: "density in the study over that in the stage; NaN where "
            "sought",
        }
    )
    promise = (
        "trials out of limit were sought in stages; the last stage, independent "
        "weighted trials, tells the fraction out of limit, with a gamma interval"
    )

    def unfit(self, trials: int, factors: int) -> str:
        """Return why a number of trials does not fit."""
        if not factors:
            return (
                "nothing deviates: no machine is rare; give a line in [deviations], "
                'such as rod_length = "+-1.2 mm", or a link its tolerance'
            )
        if trials < LEAST_TRIALS:
            return (
                f'sampling = "rare" needs {LEAST_TRIALS} trials or more: 3 of 5 are to '
                f"find trials out of limit; {self.usual_trials(factors)} are plenty"
            )
        return ""

    def usual_trials(self, factors: int) -> int:
        """Return a number of trials that is enough for search and estimate."""
        return max(ENOUGH, safe_trials(factors))

    def warnings(self, trials: int, factors: int) -> tuple[str, ...]:
        """Return warnings that a number of trials may be too small."""
        safe = safe_trials(factors)
        if trials >= safe:
            return ()
        return (
            f"of several kinds of out-of-limit trials a smaller one may be lost among "
            f"{factors} deviations with {trials} trials, and the interval is then of "
            f"the others: trials = {safe} or more look for it",
        )

    def stages(
        self, seed: int, streams: Mapping[str, int], trials: int
    ) -> Generator[rare_stage.RareStage, Array, None]:
        """Yield stages; the arguments are as of `Sampler.stages`."""
        seeking = _Search(seed, streams)
        mixture = centred(SPREADS, len(streams))
        yield from seeking.stage(mixture, round(FIRST * trials), 0.0)
        near, used = yield from subset_simulation(seed, streams, round(STEP * trials))
        left = trials - used
        at_one, each = 0, trials_of_stage(trials, len(streams))
        while left - seeking.trials - each >= (1 - SEARCHING) * trials:
            mixture, spread = seeking.fit(each)
            at_one += spread == 1
            if at_one > MOST_AT_ONE:
                break
            wide = centred(np.array([max(spread, SPREADS[0])]), len(streams))
            if near:
                mixture = mixture.beside(NEAR, near)
            yield from seeking.stage(mixture.beside(PLAIN, wide), each, spread)
        plain, wide = (centred(np.array([s]), len(streams)) for s in (1.0, 2.0))
        found = seeking.fit(each)[0] if seeking.any_out_of_limit else near
        if found:
            mixture = found.beside(NEAR_LAST, near) if near else found
            mixture = mixture.beside(WIDE, wide).beside(PLAIN, plain)
        else:
            mixture = plain
        yield from seeking.stage(mixture, left - seeking.trials, 1.0, last=True)


def trials_of_stage(trials: int, directions: int) -> int:
    """Return the number of trials of a stage: as many as a fit needs, if possible.

    `directions` is the number of independent deviations.
    """
    enough = trials >= safe_trials(directions)
    return max(round(EACH * trials), _whole_stage(directions) if enough else 0)


def safe_trials(directions: int) -> int:
    """Return the number of trials at which each fit has all the points it needs.

    With fewer, a smaller one of several kinds of out-of-limit trials may be lost.
    """
    left = SEARCHING - FIRST - STEPS * STEP
    least, some, more = STAGES
    each = max(left / max(least, some + more * directions), EACH)
    return math.ceil(_whole_stage(directions) / each)


def _whole_stage(directions: int) -> int:
    return math.ceil((WORTH + FOR_EACH * directions) / MOST_OF_STAGE)


class _Search:
    """The trials of all stages so far, and the mixture for the next stage."""

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
    def any_out_of_limit(self) -> bool:
        return bool(np.any(self.margins < 0))

    def stage(
        self, mixture: Mixture, trials: int, spread: float, *, last: bool = False
    ) -> Generator[rare_stage.RareStage, Array, None]:
        """Yield a stage, and store its points and margins."""
        purpose = f"rare {len(self.counts)}"
        which = uniform(self.seed, "parts", trials, f"of {purpose}")
        scores = rare_stage.normal_scores(self.seed, self.streams, trials, purpose)
        points = mixture.points(which, scores)
        squares = np.einsum("ni,ni->n", points, points)
        weight: Array | float = np.nan
        if last:
            weight = np.exp(log_normal(squares, 1.0, points.shape[1])
                            - mixture.log_density(points))  # fmt: skip
        spreads = spread if self.counts else SPREADS[mixture.parts(which)]
        margins = yield rare_stage.stage_of(points, spreads, weight)
        if last:
            return  # no fit follows
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
        """Return a mixture fitted to the trials out of limit, and its spread.

        With fewer points, a region with one in ten of them is lost in many directions.
        With more points per stage, the spread stays wide.
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
            [log_normal(squares, s, points.shape[1]) - drawn for s in spreads]
        )
        weights = np.exp(weights - weights.max(axis=1, keepdims=True))
        effective = weights.sum(axis=1) ** 2 / np.sum(weights**2, axis=1)
        wanted = min(effective.max() / 2, MOST_OF_STAGE * trials)
        place = int(np.flatnonzero(effective >= wanted)[0])
        # as many points of equal weight: evenly spaced in the sum of the weights
        sums = np.cumsum(weights[place])
        at = (np.arange(POINTS) + 0.5) / POINTS * sums[-1]
        chosen = points[np.searchsorted(sums, at)]
        spread = float(spreads[place])
        found = fitted(chosen, float(effective[place]), spread)
        if spread == 1:
            found = _extended(found, points, weights[place])
        return found, spread


def _extended(mixture: Mixture, points: Array, weights: Array) -> Mixture:
    """Return a mixture with parts added where weights would scatter most.

    These are kinds of trials that the fit lost; after A. E. Raftery, L. Bao, Biometrics
    66 (2010) 1162-1173.
    """
    directions = points.shape[1]
    squares = np.einsum("ni,ni->n", points, points)
    aimed = np.log(weights + 1e-300) + log_normal(squares, 1.0, directions)
    for _ in range(ADDED):
        place = (aimed - mixture.log_density(points)).argmax()
        one = centred(np.array([1.0]), directions)._replace(means=points[[place]])
        mixture = mixture.beside(ADDED_SHARE, one)
    return mixture
