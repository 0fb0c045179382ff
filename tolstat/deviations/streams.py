"""Random bits that depend only on a seed and a name."""

from __future__ import annotations

import hashlib

import numpy as np
from numpy.typing import NDArray


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
