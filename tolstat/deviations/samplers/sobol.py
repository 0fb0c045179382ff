"""Scrambled Sobol' points: all contributors together are covered evenly."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from tolstat.deviations.samplers import Sampler
from tolstat.deviations.streams import random_bits, unit_samples_of

REPLICATES = 16
BITS = 32  # of a point before scrambling: 4e9 trials


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

    def unit_samples(
        self, seed: int, streams: Mapping[str, int], trials: int
    ) -> NDArray[np.float64]:
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
