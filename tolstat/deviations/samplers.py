"""The samplers, by their names in study files."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from tolstat.deviations.rare import Rare
from tolstat.deviations.sampler import Sampler, random_bits, unit_samples_of

Array = NDArray[np.float64]

REPLICATES = 16  # of Latin hypercubes, and scrambles of Sobol' points
BELOW_ONE = 1 - 2.0**-53
BITS = 32  # of a Sobol' point before scrambling: 4e9 trials
OWN = 2  # the first trials of a group, A and B, are independent random trials


class Random(Sampler):
    """Each name has a stream of its own, numbered by trial.

    A draw depends on the seed, the index of the trial and the name alone: adding a
    contributor, changing a tolerance or asking for more trials leaves every other draw
    as it was.
    """

    extensible = True
    promise = (
        "random trials are independent: order-statistic intervals of quantiles are "
        "exact, and those of fractions out of limit are anytime-valid"
    )

    def unit_samples(self, seed: int, streams: Mapping[str, int], trials: int) -> Array:
        """Choose unit samples."""
        samples = np.empty((trials, len(streams)))
        for column, name in enumerate(streams):
            samples[:, column] = unit_samples_of(random_bits(seed, name, trials))
        return samples


class Latin(Sampler):
    """Sixteen Latin hypercubes, independent of each other: trial i is of number i % 16.

    In each, one sample of each name lies in each of n strips of equal probability. A
    draw depends on the seed, the name, the index and the number of trials: another
    number is another sample.

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
        """Choose unit samples."""
        samples = np.empty((trials, len(streams)))
        for column, name in enumerate(streams):
            for replicate in range(min(REPLICATES, trials)):
                n = len(range(replicate, trials, REPLICATES))
                purpose = f"latin {replicate} of {n}"
                order = random_bits(seed, name, n, f"{purpose}: order")
                strip = np.argsort(order, kind="stable")
                within = unit_samples_of(
                    random_bits(seed, name, n, f"{purpose}: place")
                )
                samples[replicate::REPLICATES, column] = (strip + within) / n
        return np.minimum(samples, BELOW_ONE)  # the last strip may round up to 1


class Sobol(Sampler):
    """Sixteen scrambles of Sobol' points: trial i is of number i % 16.

    A name's dimension is its number among all names of the model, each of its scrambles
    depends on the seed and the name: a draw depends on seed, index and name alone, and
    asking for more trials keeps the first. Balanced when the number of trials is a
    power of 2.

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
        """Choose unit samples."""
        from scipy.stats import qmc  # slow to import

        samples = np.empty((trials, len(streams)))
        engine = qmc.Sobol(
            max(streams.values(), default=0) + 1, scramble=False, bits=BITS
        )
        most = math.ceil(trials / REPLICATES)
        points = engine.random_base2(math.ceil(math.log2(most)))
        for column, (name, dimension) in enumerate(streams.items()):
            whole = (points[:, dimension] * 2.0**BITS).astype(np.uint64)
            for replicate in range(min(REPLICATES, trials)):
                n = len(range(replicate, trials, REPLICATES))
                bits = _scrambled(whole[:n], seed, name, replicate)
                samples[replicate::REPLICATES, column] = unit_samples_of(bits)
        return samples


def _scrambled(
    points: NDArray[np.uint64], seed: int, name: str, replicate: int
) -> NDArray[np.uint64]:
    """Mix each bit with the higher ones, fill the lower ones, flip some: 64 bits."""
    masks = random_bits(seed, name, 64, f"sobol {replicate}: matrix")
    found = np.full_like(
        points, random_bits(seed, name, 1, f"sobol {replicate}: shift")[0]
    )
    for i in range(64):
        place = max(BITS - 1 - i, 0)
        mask = masks[i] & np.uint64(2**BITS - 2**place)
        if i < BITS:
            mask |= np.uint64(2**place)
        parity = np.bitwise_count(points & mask) & np.uint8(1)
        found ^= parity.astype(np.uint64) << np.uint64(63 - i)
    return found


class Saltelli(Sampler):
    """Groups of k + 2 trials: A and B, then A with one of k factors from B.

    Trial i is number i % (k + 2) of group i // (k + 2). A draw depends on the seed, the
    name, the group and which names vary.

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
        """Return how many trials belong together."""
        return factors + OWN

    def unfit(self, trials: int, factors: int) -> str:
        """Say why a number of trials does not fit: it holds whole groups."""
        group = self.group(factors)
        if trials % group == 0:
            return ""
        below = trials // group * group
        near = " or ".join(str(n) for n in (below, below + group) if n)
        return (
            f"a multiple of {group} is expected, {factors} contributors that deviate "
            f"and {OWN} for each point: {near}"
        )

    def unit_samples(self, seed: int, streams: Mapping[str, int], trials: int) -> Array:
        """Choose unit samples."""
        group = self.group(len(streams))
        points = math.ceil(trials / group)
        samples = np.empty((points, group, len(streams)))
        for column, name in enumerate(streams):
            a, b = (
                unit_samples_of(random_bits(seed, name, points, f"saltelli {which}"))
                for which in "AB"
            )
            samples[:, :, column] = a[:, None]
            samples[:, 1, column] = b
            samples[:, OWN + column, column] = b
        return samples.reshape(points * group, len(streams))[:trials]


SAMPLERS: dict[str, type[Sampler]] = {
    "latin": Latin,
    "random": Random,
    "rare": Rare,
    "saltelli": Saltelli,
    "sobol": Sobol,
}
