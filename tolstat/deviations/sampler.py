"""What a sampler is: a way to choose unit samples.

It says what its samples allow, and chooses them: all at once by `unit_samples`, or
stage by stage, each once the answers to those before are known, by `stages`.
"""

from __future__ import annotations

import hashlib
from collections.abc import Generator, Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Stage:
    """Trials that are drawn at once."""

    unit: Array  # float64[trial, stream]: independent unit samples

    def columns(self, number: int) -> Mapping[str, Array]:
        """Return the sampler's `columns` of the stage of this number."""
        return {}


class Sampler:
    """What every sampler says of its samples; only the promise has no default.

    Attributes
    ----------
    promise : str
        What may be said about intervals, in a sentence.
    replicates : int
        Number of independent randomisations, trial i belonging to the one of number
        i modulo it; 0 where all trials are independent of each other: only then
        order-statistic and binomial intervals hold.
    extensible : bool
        Whether more trials leave the first as they were.
    sample : bool
        Whether the trials are a sample of production: each number of theirs tells of
        the units that will be built.
    aims : bool
        Whether it seeks the limit of one response, which the study names.
    columns : mapping of str to str
        What is stored of how each trial was drawn: name and sentence.
    """

    promise: ClassVar[str]
    replicates: ClassVar[int] = 0
    extensible: ClassVar[bool] = False
    sample: ClassVar[bool] = True
    aims: ClassVar[bool] = False
    columns: ClassVar[Mapping[str, str]] = {}

    def group(self, factors: int) -> int:
        """Return how many trials belong together where so many factors vary.

        The number of trials must be a multiple of it; 1 where each stands alone.
        """
        return 1

    def unfit(self, trials: int, factors: int) -> str:
        """Say why a number of trials does not fit; empty where it does."""
        return ""

    def usual_trials(self, factors: int) -> int | None:
        """Return a number of trials that is enough; None where that depends."""
        return None

    def warnings(self, trials: int, factors: int) -> tuple[str, ...]:
        """Say before a run what so many trials will not tell."""
        return ()

    def unit_samples(self, seed: int, streams: Mapping[str, int], trials: int) -> Array:
        """Choose all unit samples.

        Parameters
        ----------
        streams : mapping of str to int
            The names to sample for, each with its fixed number among all names of the
            model.

        Returns
        -------
        float64[trial, stream]
            Above 0 and below 1, in the order of `streams`.
        """
        raise NotImplementedError

    def stages(
        self, seed: int, streams: Mapping[str, int], trials: int
    ) -> Generator[Stage, Array, None]:
        """Draw stage by stage; `seed`, `streams`, `trials` as of `unit_samples`.

        Yields
        ------
        Stage
            For each it is sent float64[trial]: how far the response that it aims at
            lies within its limit, less than 0 out of limit, minus infinity of failed
            trials; nothing where it aims at none.
        """
        yield Stage(self.unit_samples(seed, streams, trials))


def random_bits(
    seed: int, name: str, count: int, purpose: str = ""
) -> NDArray[np.uint64]:
    """Return the first uint64[count] numbers of the stream of a contributor or batch.

    They are independent and uniform. A larger count leaves the first as they are; a
    purpose names another stream.
    """
    words = f"{seed}:{name}:{purpose}" if purpose else f"{seed}:{name}"
    digest = hashlib.sha256(words.encode()).digest()
    key = np.frombuffer(digest[:16], dtype="<u8")
    return np.random.Philox(key=key).random_raw(count)


def unit_samples_of(bits: NDArray[np.uint64]) -> NDArray[np.float64]:
    """Turn bits into numbers above 0 and below 1: 52 bits and a half reach neither."""
    return np.asarray(((bits >> np.uint64(12)) + 0.5) * 2.0**-52, np.float64)
