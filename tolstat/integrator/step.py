"""One step of Dormand-Prince 5(4), written out, for all lanes at once, and its size.

Coordinates that a model names are damped in it, see `damping`. Without any, or with
their lambda zero, it is Dormand and Prince's step to the last bit.

h is the step (s), a vector; y the rows of states at its start; k its stages, K1 ... K7
of the literature, each rows of rates. The derivatives of the states come first.
"""

from fractions import Fraction

import numpy as np

from tolstat.integrator import tableau
from tolstat.integrator.damping import begin_damping, damp
from tolstat.integrator.problem import TIME
from tolstat.lanes.compiled import compiled

C2, C3, C4, C5 = (float(c) for c in tableau.C[1:5])
A21 = float(tableau.A[1][0])
A31, A32 = (float(a) for a in tableau.A[2])
A41, A42, A43 = (float(a) for a in tableau.A[3])
A51, A52, A53, A54 = (float(a) for a in tableau.A[4])
A61, A62, A63, A64, A65 = (float(a) for a in tableau.A[5])
B1, _, B3, B4, B5, B6, _ = (float(b) for b in tableau.B)
E1, _, E3, E4, E5, E6, E7 = (float(e) for e in tableau.E)
H1, _, H3, H4, H5, H6, H7 = (float(w) for w in tableau.dense_weights(Fraction(1, 2)))
DENSE = np.array([[float(w) for w in row] for row in tableau.DENSE])


@compiled(within=True)
def advance(rates, t, h, t_new, y, p, step):
    """Fill the stages of a step and the states at its end.

    Parameters
    ----------
    rates : function
        Compiled with `rates_signature`.
    t, h, t_new : vector
        Time before the step, the step, time after it, s; t + h may differ from the end
        of a phase by rounding.
    y, p : rows
        States before the step, and parameters.
    step : Step
        The phase of its moment is that of the whole step. K1 holds the rates at (t, y),
        undamped for damped states. Meanwhile `end` holds the states of each stage.
    """
    moment, new, k, n = step.moment, step.end, step.k, len(y)
    K1, K2, K3, K4, K5, K6 = k[0], k[1], k[2], k[3], k[4], k[5]
    begin_damping(h, step)
    for i in range(n):
        new[i] = y[i] + h * (A21 * K1[i])
    moment[TIME] = t + C2 * h
    rates(moment, new, p, K2)
    damp(1, step)
    for i in range(n):
        new[i] = y[i] + h * (A31 * K1[i] + A32 * K2[i])
    moment[TIME] = t + C3 * h
    rates(moment, new, p, K3)
    damp(2, step)
    for i in range(n):
        new[i] = y[i] + h * (A41 * K1[i] + A42 * K2[i] + A43 * K3[i])
    moment[TIME] = t + C4 * h
    rates(moment, new, p, K4)
    damp(3, step)
    for i in range(n):
        new[i] = y[i] + h * (A51 * K1[i] + A52 * K2[i] + A53 * K3[i] + A54 * K4[i])
    moment[TIME] = t + C5 * h
    rates(moment, new, p, K5)
    damp(4, step)
    for i in range(n):
        new[i] = y[i] + h * (
            A61 * K1[i] + A62 * K2[i] + A63 * K3[i] + A64 * K4[i] + A65 * K5[i]
        )
    moment[TIME] = t_new
    rates(moment, new, p, K6)
    damp(5, step)
    for i in range(n):
        new[i] = y[i] + h * (
            B1 * K1[i] + B3 * K3[i] + B4 * K4[i] + B5 * K5[i] + B6 * K6[i]
        )
    rates(moment, new, p, k[6])
    damp(6, step)


@compiled(within=True)
def error_of(h, k, i):
    """Return the error estimate of the i-th state: the step less the embedded one."""
    K1, K3, K4, K5, K6, K7 = k[0], k[2], k[3], k[4], k[5], k[6]
    return h * (
        E1 * K1[i] + E3 * K3[i] + E4 * K4[i] + E5 * K5[i] + E6 * K6[i] + E7 * K7[i]
    )


@compiled(within=True)
def worst_error(h, k, per_scale):
    """Return the largest error estimate of each lane, over the scale of its state."""
    worst = 0.0 * h
    for i in range(len(per_scale)):
        worst = np.maximum(worst, np.abs(error_of(h, k, i)) * per_scale[i])
    return worst


@compiled()
def worst_state(h, k, per_scale):
    """Return the number of the state with that error, of each lane."""
    worst, number = -1.0 + 0.0 * h, 0.0 * h
    for i in range(len(per_scale)):
        error = np.abs(error_of(h, k, i)) * per_scale[i]
        larger = ~(error <= worst)  # also what is not finite
        worst = np.where(larger, error, worst)
        number = np.where(larger, 1.0 * i, number)
    return number


@compiled(within=True)
def quadrature_of(h, k, i):
    """Return the integral of the i-th rate over the step."""
    K1, K3, K4, K5, K6 = k[0], k[2], k[3], k[4], k[5]
    return h * (B1 * K1[i] + B3 * K3[i] + B4 * K4[i] + B5 * K5[i] + B6 * K6[i])


@compiled(within=True)
def halfway(h, y, k, y_middle):
    """Store the interpolated states in the middle of the step."""
    K1, K3, K4, K5, K6, K7 = k[0], k[2], k[3], k[4], k[5], k[6]
    for i in range(len(y)):
        y_middle[i] = y[i] + h * (
            H1 * K1[i] + H3 * K3[i] + H4 * K4[i] + H5 * K5[i] + H6 * K6[i] + H7 * K7[i]
        )


@compiled(within=True)
def _dense_weight(stage, theta):
    """Return the weight of a stage, from 0, for the state at a fraction of the step."""
    weight = DENSE[stage, 0] + theta * (
        DENSE[stage, 1] + theta * (DENSE[stage, 2] + theta * DENSE[stage, 3])
    )
    return weight * theta


@compiled(within=True)
def interpolate(h, theta, y, k, lane, i):
    """Return the i-th state of a lane at the fraction theta of the step."""
    total = 0.0
    for stage in range(7):
        total += _dense_weight(stage, theta) * k[stage][i, lane]
    return y[i, lane] + h * total


@compiled(within=True)
def inside(h, theta, y, k, y_inside):
    """Store the states of all lanes, each at its fraction theta of the step."""
    for i in range(len(y)):
        y_inside[i] = y[i]
    for stage in range(7):
        weight, K = h * _dense_weight(stage, theta), k[stage]
        for i in range(len(y)):
            y_inside[i] = y_inside[i] + weight * K[i]


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
