"""The drive's equations (2) in registers, for any number of links and steps.

Rows of the parameters, of `motion.equations`: A C and A H by rows; then of each phase
what its begin adds to B Q^-1 M. States are the twists, then their rates.
"""

import numpy as np

from tolstat.moving import Moment, compiled, named, rates_signature, rows


@compiled(rates_signature)
def rates(moment, y, p, out):
    """Fill phi_ij', phi_ij'', then phi_ij, which have peaks."""
    phase, Y, P, filled = named(Moment, moment).phase, rows(y), rows(p), rows(out)
    n = len(y) // 2
    for i in range(n):
        phi__ = 0.0 * phase
        for j in range(n):
            phi__ = phi__ - P[i * n + j] * Y[j] - P[(n + i) * n + j] * Y[n + j]
        for k in range(len(p) // n - 2 * n):
            phi__ = phi__ + np.where(phase >= float(k), P[(2 * n + k) * n + i], 0.0)
        filled[i], filled[n + i], filled[2 * n + i] = Y[n + i], phi__, Y[i]


@compiled(rates_signature)
def watch(moment, y, p, out):
    """Fill the twists alone."""
    Y, filled = rows(y), rows(out)
    for i in range(len(y) // 2):
        filled[i] = Y[i]
