"""How long the next step may be."""

from __future__ import annotations

import numpy as np

from tolstat.lanes.compiled import compiled

SAFETY = 0.9
SHRINK_MOST = 0.2
GROW_MOST = 5.0
AFTER_NAN = 0.1
FIRST_STEP = 1e-3  # of the longest step: the controller finds its way from there


@compiled(within=True)
def inverse_fifth_root(x):
    """Return x^(-1/5) to 0.5 % for 1e-4 <= x <= 1e4, without `pow`.

    x^(-3/16) by square roots, then two Newton steps: `pow`, lane by lane, would cost
    an eighth of the whole integration.
    """
    eighth = np.sqrt(np.sqrt(np.sqrt(x)))
    z = 1.0 / (eighth * np.sqrt(eighth))
    z = z * (1.2 - 0.2 * x * (z * z) * (z * z) * z)
    return z * (1.2 - 0.2 * x * (z * z) * (z * z) * z)


@compiled(within=True)
def step_factor(error):
    """Scale the step by its error, which is 1 at the tolerance.

    Not a number shrinks the step: the state may have left the domain of the
    equations only because the step was too long.
    """
    inside = np.minimum(np.maximum(error, 1e-4), 1e4)
    factor = SAFETY * inverse_fifth_root(inside)
    factor = np.minimum(np.maximum(factor, SHRINK_MOST), GROW_MOST)
    factor = np.where(error <= 1.0, factor, np.minimum(factor, 1.0))
    return np.where(np.isfinite(error), factor, AFTER_NAN)
