"""Samplers: ways to choose unit samples.

Each declares the properties of its samples. `unit_samples` chooses all at once;
`stages` chooses stage by stage, each from the responses of the stages before.
"""

import hashlib
import math
from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from tolstat.arrays import Array

REPLICATES = 16  # of Latin hypercubes, and scrambles of Sobol' points
BELOW_ONE = 1 - 2.0**-53
BITS = 32  # of a Sobol' point before scrambling: 4e9 trials
COUNTED = 4  # numbers of a random stream that its generator makes at once
OWN = 2  # the first trials of a group, A and B, are independent random trials
# columns of each trial of a rare run; no response can have these names
STAGE, SPREAD, DISTANCE, WEIGHT = (
    "rare-stage", "rare-spread", "rare-distance", "rare-weight",
)  # fmt: skip
AS_STUDY = 0.1  # share of its stages as in the study: no weight is above one over it


@dataclass(frozen=True)
class Stage:
    """Trials that are sampled at once.

    Attributes
    ----------
    unit : float64[trial, stream]
        Independent unit samples.
    log_ratio : float64[trial]
        Logarithm of the density of each trial in the study over its density in the
        stage: 0 where they are sampled as in the study, NaN in a search.
    number : int
        Number of the stage in its course.
    """

    unit: Array
    log_ratio: Array
    number: int = field(default=0, kw_only=True)

    def columns(self) -> Mapping[str, Array]:
        """Return the sampler's `columns` of the trials."""
        return {}


class Sampler:
    """Interface and properties of every sampler; only the promise has no default."""

    promise: ClassVar[str]  # properties of the intervals, in a sentence
    # number of independent randomisations; trial i is of number i modulo it. 0 if all
    # trials are independent: only then order-statistic and binomial intervals hold.
    replicates: ClassVar[int] = 0
    # whether more trials leave the first trials unchanged
    extensible: ClassVar[bool] = False
    # whether the trials are a sample of production: their statistics estimate those of
    # the units that will be built
    sample: ClassVar[bool] = True
    # whether it searches the limit of one response, which the study names
    aims: ClassVar[bool] = False
    # stored columns of the sampling of each trial: name and sentence
    columns: ClassVar[Mapping[str, str]] = {}

    def group(self, factors: int) -> int:
        """Return the number of trials in a group, for a number of factors that vary.

        The number of trials must be a multiple of it; 1 without groups.
        """
        return 1

    def unfit(self, trials: int, factors: int) -> str:
        """Return why a number of trials does not fit; empty if it does."""
        return ""

    def usual_trials(self, factors: int) -> int | None:
        """Return a number of trials that is enough; None if it depends."""
        return None

    def warnings(self, trials: int, factors: int) -> tuple[str, ...]:
        """Return warnings that a number of trials may be too small."""
        return ()

    def unit_samples(self, seed: int, streams: Mapping[str, int], trials: int) -> Array:
        """Return all unit samples: float64[trial, stream], above 0 and below 1.

        `streams` are the names to sample for, in order, each with its fixed number
        among all names of the model.
        """
        raise NotImplementedError

    def stages(
        self, seed: int, streams: Mapping[str, int], trials: int
    ) -> Generator[Stage, Array, None]:
        """Yield stages; `seed`, `streams`, `trials` as of `unit_samples`.

        For each send float64[trial], the margins of the response that it aims at:
        distance within the limit, below 0 out of limit, minus infinity of failed
        trials; nothing if it aims at none.
        """
        yield Stage(self.unit_samples(seed, streams, trials), np.zeros(trials))


class Random(Sampler):
    """Each name has a separate stream, numbered by trial.

    A sample depends only on the seed, the index of the trial and the name. Adding a
    contributor, changing a tolerance or requesting more trials leaves every other
    sample unchanged.
    """

    extensible = True
    promise = (
        "random trials are independent: order-statistic intervals of quantiles are "
        "exact, and those of fractions out of limit are anytime-valid"
    )

    def unit_samples(self, seed: int, streams: Mapping[str, int], trials: int) -> Array:
        """Return unit samples."""
        return self.from_trial(0, seed, streams, trials)

    def from_trial(
        self, first: int, seed: int, streams: Mapping[str, int], trials: int
    ) -> Array:
        """Return the unit samples of so many trials, from one on."""
        samples = np.empty((trials, len(streams)))
        for column, name in enumerate(streams):
            samples[:, column] = uniform(seed, name, trials, first=first)
        return samples


class Latin(Sampler):
    """Sixteen independent Latin hypercubes: trial i belongs to number i % 16.

    In each, one sample of each name lies in each of n strips of equal probability. A
    sample depends on the seed, the name, the index and the number of trials: another
    number gives other trials.

    References
    ----------
    M. D. McKay, R. J. Beckman, W. J. Conover, Technometrics 21 (1979) 239-245.
    """

    replicates = REPLICATES
    promise = (
        "Latin hypercube trials depend on each other: averages are at least nearly as "
        "good as of random trials, often better; intervals come from the scatter "
        "between 16 independent hypercubes and are approximate"
    )

    def unit_samples(self, seed: int, streams: Mapping[str, int], trials: int) -> Array:
        """Return unit samples."""
        samples = np.empty((trials, len(streams)))
        for column, name in enumerate(streams):
            for replicate in range(min(REPLICATES, trials)):
                n = len(range(replicate, trials, REPLICATES))
                purpose = f"latin {replicate} of {n}"
                order = random_bits(seed, name, n, f"{purpose}: order")
                strip = np.argsort(order, kind="stable")
                within = uniform(seed, name, n, f"{purpose}: place")
                samples[replicate::REPLICATES, column] = (strip + within) / n
        return np.minimum(samples, BELOW_ONE)  # the last strip may round up to 1


class Sobol(Sampler):
    """Sixteen scrambles of Sobol' points: trial i belongs to number i % 16.

    A name's dimension is its number among all names of the model. Its scrambles depend
    on the seed and the name. So a sample depends only on seed, index and name: more
    trials keep the first. They are balanced if the number of trials is a power of 2.

    References
    ----------
    S. Joe, F. Y. Kuo, SIAM J. Sci. Comput. 30 (2008) 2635-2654: direction numbers, as
    SciPy has them. J. Matousek, J. Complexity 14 (1998) 527-556: linear scramble and
    digital shift.
    """

    replicates = REPLICATES
    extensible = True
    promise = (
        "Sobol' trials depend on each other: averages of smooth responses are far "
        "better than of random trials; intervals come from the scatter between 16 "
        "independent scrambles and are approximate; powers of 2 are balanced"
    )

    def unit_samples(self, seed: int, streams: Mapping[str, int], trials: int) -> Array:
        """Return unit samples."""
        from scipy.stats import qmc  # slow to import

        samples = np.empty((trials, len(streams)))
        dimensions = max(streams.values(), default=0) + 1
        engine = qmc.Sobol(dimensions, scramble=False, bits=BITS)
        most = math.ceil(trials / REPLICATES)
        points = engine.random_base2(math.ceil(math.log2(most)))
        for column, (name, dimension) in enumerate(streams.items()):
            integers = (points[:, dimension] * 2.0**BITS).astype(np.uint64)
            for replicate in range(min(REPLICATES, trials)):
                n = len(range(replicate, trials, REPLICATES))
                bits = _scrambled(integers[:n], seed, name, replicate)
                samples[replicate::REPLICATES, column] = unit_samples_of(bits)
        return samples


def _scrambled(
    points: NDArray[np.uint64], seed: int, name: str, replicate: int
) -> NDArray[np.uint64]:
    """Return 64 bits: each mixed with the higher ones, the lower ones filled."""
    masks = random_bits(seed, name, 64, f"sobol {replicate}: matrix")
    shift = random_bits(seed, name, 1, f"sobol {replicate}: shift")
    scrambled = np.full_like(points, shift[0])
    for i in range(64):
        position = max(BITS - 1 - i, 0)
        mask = masks[i] & np.uint64(2**BITS - 2**position)
        if i < BITS:
            mask |= np.uint64(2**position)
        parity = np.bitwise_count(points & mask) & np.uint8(1)
        scrambled ^= parity.astype(np.uint64) << np.uint64(63 - i)
    return scrambled


class Saltelli(Sampler):
    """Groups of k + 2 trials: A and B, then A with one of k factors from B.

    Trial i is number i % (k + 2) of group i // (k + 2). A sample depends on the seed,
    the name, the group and the names that vary.

    References
    ----------
    A. Saltelli et al., Variance based sensitivity analysis of model output, Computer
    Physics Communications 181 (2010) 259-270, the radial design of table 2.
    """

    promise = (
        "Saltelli's design: the first two trials of each group are independent, and "
        "quantiles and shares rest on these alone, with exact intervals; all of them "
        "together give the Sobol' indices"
    )

    def group(self, factors: int) -> int:
        """Return the number of trials in a group."""
        return factors + OWN

    def unfit(self, trials: int, factors: int) -> str:
        """Return why a number of trials does not fit: groups must be whole."""
        group = self.group(factors)
        if trials % group == 0:
            return ""
        below = trials // group * group
        multiples = " or ".join(str(n) for n in (below, below + group) if n)
        return (
            f"a multiple of {group} is expected, {factors} contributors that deviate "
            f"and {OWN} for each point: {multiples}"
        )

    def unit_samples(self, seed: int, streams: Mapping[str, int], trials: int) -> Array:
        """Return unit samples."""
        group = self.group(len(streams))
        points = math.ceil(trials / group)
        pairs = self.pairs(seed, list(streams), points)
        samples = np.repeat(pairs[:, :1], group, axis=1)
        samples[:, 1] = pairs[:, 1]
        for factor in range(len(streams)):
            samples[:, OWN + factor, factor] = pairs[:, 1, factor]
        return samples.reshape(points * group, len(streams))[:trials]

    def pairs(self, seed: int, names: Sequence[str], groups: int) -> Array:
        """Return the unit samples of trials A and B: float64[group, 2, name]."""
        samples = np.empty((groups, OWN, len(names)))
        for column, name in enumerate(names):
            for number, trial in enumerate("AB"):
                purpose = f"saltelli {trial}"
                samples[:, number, column] = uniform(seed, name, groups, purpose)
        return samples


def random_bits(
    seed: int, name: str, count: int, purpose: str = "", first: int = 0
) -> NDArray[np.uint64]:
    """Return uint64[count] numbers of the stream of a contributor or batch.

    They are independent and uniform. A larger count leaves the first unchanged; a
    purpose names another stream. They begin with number `first`.
    """
    words = f"{seed}:{name}:{purpose}" if purpose else f"{seed}:{name}"
    digest = hashlib.sha256(words.encode()).digest()
    key = np.frombuffer(digest[:16], dtype="<u8")
    stream = np.random.Philox(key=key)
    if not first:
        return stream.random_raw(count)
    stream.advance(first // COUNTED)
    part: NDArray[np.uint64] = stream.random_raw(first % COUNTED + count)
    return part[first % COUNTED :]


def unit_samples_of(bits: NDArray[np.uint64]) -> Array:
    """Return numbers above 0 and below 1: 52 bits and a half reach neither."""
    return np.asarray(((bits >> np.uint64(12)) + 0.5) * 2.0**-52, np.float64)


def uniform(
    seed: int, name: str, count: int, purpose: str = "", first: int = 0
) -> Array:
    """Return float64[count] unit samples of a stream: see `random_bits`."""
    return unit_samples_of(random_bits(seed, name, count, purpose, first))
