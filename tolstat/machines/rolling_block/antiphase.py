"""Gaps between stands whose rolls swing against each other: there tension swings.

References
----------
P. V. Krot (2010), Table 1 and the text before it: at 22.7 and 62.8 Hz stands 32-33, at
25.2 Hz 33-34, at 31.8 Hz 31-32, at the others none.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from tolstat.machines.rolling_block.topology import STANDS

Array = NDArray[np.float64]

# A stand that swings less than this share of the shape's largest part stands still.
# With 0.2 the paper's gap at 62.8 Hz is lost; with 0.01 small deviations change the
# pattern.
STILL = 0.1


def antiphase(phi: Array) -> NDArray[np.bool_]:
    """Find the gaps whose stands swing in antiphase.

    Parameters
    ----------
    phi : float64[trial, mass, mode]
        Shapes.

    Returns
    -------
    bool[trial, mode, gap]
        Gaps 31-32, 32-33, 33-34.
    """
    size = np.abs(phi)
    moving = size > STILL * np.max(size, axis=1, keepdims=True)
    gaps = [
        (phi[:, i] * phi[:, j] < 0) & moving[:, i] & moving[:, j]
        for i, j in pairwise(STANDS.values())
    ]
    return np.stack(gaps, axis=-1)
