"""The search of a rare run: trials with known densities, and mixtures from them."""

from collections.abc import Sequence

import numpy as np

from tolstat.arrays import Array
from tolstat.deviations.mixture import (
    Mixture,
    centred,
    fitted,
    log_study,
    normal_of,
    tempered,
)
from tolstat.deviations.rare_stage import Found, RandomNumbers, Stages, stage_of
from tolstat.deviations.samplers import AS_STUDY
from tolstat.deviations.subset_simulation import relaxed, slope

SPREADS = np.array([1.5, 2.0, 3.0, 4.0])  # of the first stage, in normal scores
STAGES = 5  # of fits
CHAINS, MOVES = 0.03, 0.24  # shares of the trials: chains at most, all their moves
CLONES = 8  # chains that begin with the same trial, at most
# shares of the trials: of a stage; to choose between fits; for all stages, or moves
OF_STAGE, OF_CHOICE = 0.04, 0.03
FOR_STAGES, FOR_MOVES = STAGES * OF_STAGE, OF_STAGE + MOVES + OF_CHOICE
LEAST_FAILURES = 30  # out-of-limit trials about likely points, or these are not used
FARTHER = 16.0  # squared distance, beyond subset simulation's, that is still far
LEAST_RISE = 1.3  # of effective sample sizes, from which the first stage is used
LIGHTEST = -14.0  # logarithm of a weight over the largest; lighter ones are left out
ADDED, ADDED_SHARE = 10, 0.03  # parts added to the fits; share of each
WIDE = 0.05  # share of a stage that is twice as wide as the study
OF_POINTS, OF_POINTS_LAST = 0.5, 0.2  # about likely points: in a stage, the last
LEAST_SHARE = 0.1  # of either of two fits


class Search:
    """Stages of a rare run, and the mixtures that they lead to."""

    def __init__(self, numbers: RandomNumbers, trials: int) -> None:
        self.numbers, self.trials = numbers, trials
        self.left = trials
        # of the stages with known densities
        self.points = np.empty((0, len(numbers.streams)))
        self.margins = np.empty(0)
        self.counts: list[int] = []
        self.mixtures: list[Mixture] = []

    @property
    def out_of_limit(self) -> Array:
        """float64[trial, direction] out of limit, of stages with known densities."""
        return self.points[self.margins < 0]

    def counted(self, going: Stages[tuple[Found, int]]) -> Stages[Found]:
        """Yield stages that return their number of trials, too."""
        result, used = yield from going
        self.left -= used
        return result

    def stage(self, mixture: Mixture, share: float) -> Stages[None]:
        """Yield a stage of a share of the trials; the first one is of `SPREADS`."""
        purpose = f"rare {len(self.counts)}"
        trials = round(share * self.trials)
        points, which = self._sampled(mixture, trials, purpose)
        spread = 1.0 if self.counts else SPREADS[mixture.parts(which)]
        margins = yield stage_of(points, spread)
        self.left -= trials
        self.points = np.concatenate([self.points, points])
        self.margins = np.append(self.margins, margins)
        self.counts.append(trials)
        self.mixtures.append(mixture)

    def last_stage(self, mixture: Mixture) -> Stages[None]:
        """Yield all trials that are left, weighted."""
        mixture = _beside_study(mixture)
        points, _ = self._sampled(mixture, self.left, "rare last")
        yield stage_of(points, log_ratio=_excess(points, mixture))

    def _sampled(
        self, mixture: Mixture, trials: int, purpose: str
    ) -> tuple[Array, Array]:
        which = self.numbers.unit("parts", trials, purpose)
        return mixture.points(which, self.numbers.scores(trials, purpose)), which

    def in_stages(self, centres: Mixture, halves: Sequence[Array]) -> Stages[Mixture]:
        """Yield stages about likely points, and from fits to what they found.

        If the median trial is out of limit, it is the only likely point, and failures
        about it are missed. So a normal distribution of the trials of subset simulation
        is added.
        """
        if all(map(len, halves)):
            centres = centres.mixed(1 / (1 + len(centres.shares)), normal_of(halves))
        mixture = centres
        for stage in range(STAGES):
            yield from self.stage(_beside_study(mixture), OF_STAGE)
            share = OF_POINTS_LAST if stage == STAGES - 1 else OF_POINTS
            mixture = self._fit(centres).mixed(share, centres)
        return mixture

    def at_once(
        self, centres: Mixture, halves: Sequence[Array], *, reached: bool
    ) -> Stages[Mixture]:
        """Yield a stage about likely points, then moves of out-of-limit trials.

        Parameters
        ----------
        centres : Mixture
            About the likely points.
        halves : sequence of two float64[trial, direction]
            Out-of-limit trials of subset simulation. If there is one likely point, they
            are used only where too few trials about it are out of limit.
        reached : bool
            Whether trials came together at the likely points. If they did not, and are
            still far from the median trial, the points are not used.
        """
        yield from self.stage(centres, OF_STAGE)
        trials = self.counts[-1]
        tried, margins = self.points[-trials:], self.margins[-trials:]
        led, survivors = tried[margins < 0], np.concatenate(halves)
        single, survived = len(centres.shares) == 1, all(map(len, halves))
        if len(led) < LEAST_FAILURES:
            led = led[:0]
        elif single:
            survived = False
        elif survived and not reached:
            distant, closer = (np.mean(np.sum(x**2, axis=1)) for x in (led, survivors))
            if distant - closer > FARTHER:
                led = led[:0]
        if not len(led) and not survived:
            return centres
        groups = [led[0::2], led[1::2]] if len(led) else []
        groups += halves if survived else []
        groups = yield from self._moved(groups, centres, tried, margins)
        if len(groups) == 2 and (single or survived):
            return normal_of(groups)
        points = np.concatenate(groups[:2])
        mixture = fitted(points, np.zeros(len(points)), centres)
        mixture = mixture.mixed(OF_POINTS_LAST, centres)
        if not survived:
            return mixture
        return (yield from self._chosen(mixture, normal_of(groups[2:])))

    def _moved(
        self, groups: Sequence[Array], centres: Mixture, tried: Array, margins: Array
    ) -> Stages[list[Array]]:
        """Yield moves of groups of trials; return as many trials of each, moved."""
        most = round(CHAINS * self.trials) // len(groups)
        number = min(most, CLONES * min(map(len, groups)))
        points = np.concatenate([in_equal_numbers(x, number) for x in groups])
        sweeps = round(MOVES * self.trials) // len(points)
        # the slope of each kind, or its direction where its trials are few
        kind, axes = centres.log_parts(tried).argmax(axis=0), centres.means.copy()
        for i in np.unique(kind):
            axes[i] = slope(tried[kind == i], margins[kind == i])
        length = np.sqrt(np.einsum("ki,ki->k", axes, axes))[:, None]
        axes = axes / np.maximum(length, 1e-9)
        axes = axes[centres.log_parts(points).argmax(axis=0)]
        points = yield from relaxed(
            self.numbers, points, sweeps, (tried, margins), axes
        )
        self.left -= sweeps * len(points)
        return np.split(points, len(groups))

    def _chosen(self, first: Mixture, second: Mixture) -> Stages[Mixture]:
        """Yield a stage of two mixtures, and return them in the shares that suit."""
        share = 0.5
        yield from self.stage(_beside_study(first.mixed(share, second)), OF_CHOICE)
        last = slice(-self.counts[-1], None)
        points = self.points[last][self.margins[last] < 0]
        if not len(points):
            return first.mixed(share, second)
        weights, _ = tempered(_excess(points, self.mixtures[-1]))
        logs = np.array([mixture.log_density(points) for mixture in (first, second)])
        for _ in range(50):  # expectation-maximisation of the shares
            weighted = logs + np.log([[1 - share], [share]])
            belongs = np.exp(weighted[1] - np.logaddexp.reduce(weighted))
            share = float(np.average(belongs, weights=weights))
            share = min(max(share, LEAST_SHARE), 1 - LEAST_SHARE)
        return first.mixed(share, second)

    def _fit(self, centres: Mixture) -> Mixture:
        """Return a mixture fitted to the trials out of limit.

        Those of the first stage are many and far; they count if they help.
        """
        later, of_all = self._weighted(1), self._weighted(0)
        of_few, more = (_effective(logs) for _, logs in (later, of_all))
        points, logs = of_all if more > LEAST_RISE * of_few else later
        if not len(points):
            return centres
        heavy = logs > logs.max() + LIGHTEST
        return _extended(fitted(points[heavy], logs[heavy], centres), points, logs)

    def _weighted(self, first: int) -> tuple[Array, Array]:
        """Return trials out of limit of stages, and the logarithms of their weights."""
        start = slice(sum(self.counts[:first]), None)
        points = self.points[start][self.margins[start] < 0]
        counts = np.array(self.counts[first:])
        part = [mixture.log_density(points) for mixture in self.mixtures[first:]]
        sampled = np.array(part) + np.log(counts / counts.sum())[:, None]
        return points, log_study(points) - np.logaddexp.reduce(sampled)


def in_equal_numbers(points: Array, number: int) -> Array:
    """Return as many points, evenly spaced among those given, repeated if need be."""
    return points[((np.arange(number) + 0.5) * len(points) / number).astype(np.int64)]


def _beside_study(mixture: Mixture) -> Mixture:
    plain, wide = (centred(np.array([s]), mixture.means.shape[1]) for s in (1.0, 2.0))
    return mixture.mixed(WIDE, wide).mixed(AS_STUDY, plain)


def _excess(points: Array, mixture: Mixture) -> Array:
    """Return the logarithms of the densities in the study over those in a mixture."""
    return log_study(points) - mixture.log_density(points)


def _effective(logs: Array) -> float:
    if not len(logs):
        return 0.0
    weights = np.exp(logs - logs.max())
    return float(weights.sum() ** 2 / np.square(weights).sum())


def _extended(mixture: Mixture, points: Array, logs: Array) -> Mixture:
    """Return a mixture with parts added at the heaviest points.

    They stand for kinds of trials that the fit lost; after A. E. Raftery, L. Bao,
    Biometrics 66 (2010) 1162-1173.
    """
    aimed = logs + log_study(points)
    sampled = mixture.log_density(points)
    for _ in range(ADDED):
        heaviest = (aimed - sampled).argmax()
        part = centred(np.ones(1), points.shape[1])._replace(means=points[[heaviest]])
        mixture = mixture.mixed(ADDED_SHARE, part)
        added = np.log(ADDED_SHARE) + part.log_density(points)
        sampled = np.logaddexp(np.log1p(-ADDED_SHARE) + sampled, added)
    return mixture
