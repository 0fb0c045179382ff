"""Independent random samples."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray


class Random:
    """Each contributor has a stream of its own, numbered by trial.

    A draw depends on the seed, the index of the trial and the contributor's name
    alone: adding a contributor, changing a tolerance or asking for more trials leaves
    every other draw as it was.
    """

    def unit_samples(
        self, seed: int, names: Sequence[str], trials: int
    ) -> NDArray[np.float64]:
        """Draw unit samples.

        Parameters
        ----------
        seed : int
            Of the study.
        names : sequence of str
            The contributors.
        trials : int
            How many, numbered from 0.

        Returns
        -------
        float64[trial, contributor]
            Above 0 and below 1.
        """
        samples = np.empty((trials, len(names)))
        for column, name in enumerate(names):
            digest = hashlib.sha256(f"{seed}:{name}".encode()).digest()
            key = np.frombuffer(digest[:16], dtype="<u8")
            bits = np.random.Philox(key=key).random_raw(trials)
            # 52 bits and a half: neither 0 nor 1 can come out
            samples[:, column] = ((bits >> np.uint64(12)) + 0.5) * 2.0**-52
        return samples
