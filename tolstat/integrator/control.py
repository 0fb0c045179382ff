"""Control of the step size."""

import numpy as np

from tolstat.lanes.compiled import compiled

SAFETY = 0.9
SHRINK_MOST = 0.2
GROW_MOST = 5.0
AFTER_NAN = 0.1
FIRST_STEP = 1e-3  # of the longest step: the controller adapts from there


@compiled(within=True)
def aim(t, step, target):
    """Return the step to be tried; it lands on the mark.

    Returns
    -------
    tuple
        The step, the time after it (vectors, s), whether this is the mark (mask).
    """
    remaining = target - t
    landing = step >= remaining
    # two equal steps rather than a long one and a tiny one
    h = np.where(2.0 * step > remaining, 0.5 * remaining, step)
    h = np.where(landing, remaining, h)
    # t + (target - t) can miss the target
    return h, np.where(landing, target, t + h), landing


@compiled(within=True)
def _sixteenth_root(x):
    """Return x^(1/16) by square roots; `pow`, lane by lane, costs far more."""
    return np.sqrt(np.sqrt(np.sqrt(np.sqrt(x))))


@compiled(within=True)
def step_factor(error, last_root):
    """Return the factor of the next step, from its error and the last one.

    Parameters
    ----------
    error : vector
        Error of this step, 1 at the tolerance. NaN shrinks the step: the state may have
        left the domain of the equations only because the step was too long.
    last_root : vector
        Sixteenth root of the error of the last accepted step; 1 at a start.

    Returns
    -------
    tuple of vector
        The factor, and the root for the next call.

    References
    ----------
    E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, IV.2: such a
    proportional and integral control, here with the exponents 1/8 and 1/16, keeps
    steps at the limit of stability smooth. After a rejection the exponent is 3/16.
    """
    root = _sixteenth_root(np.minimum(np.maximum(error, 1e-6), 1e6))
    accepted = error <= 1.0
    factor = np.where(accepted, last_root / (root * root), 1.0 / (root * root * root))
    factor = np.minimum(np.maximum(SAFETY * factor, SHRINK_MOST), GROW_MOST)
    factor = np.where(accepted, factor, np.minimum(factor, 1.0))
    factor = np.where(np.isfinite(error), factor, AFTER_NAN)
    return factor, np.where(accepted, root, last_root)
