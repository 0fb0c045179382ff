"""Parts, and the trials in which they fail."""

from __future__ import annotations

import numpy as np


def parts(n, k, seed):
    X = np.random.default_rng(seed).normal(size=(k, n))
    return {f"part_{i + 1}": x for i, x in enumerate(X)}


def worst(y, m):
    return y >= np.sort(y)[-m]
