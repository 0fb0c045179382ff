"""Linear damping of stiff coordinates inside the step of Dormand and Prince.

Purpose. The explicit step h is stable only to h lambda = 3.3. lambda = -dF/du >= 0 is
the rate at which a coordinate u, du/dt = F(t, y), relaxes. Friction that holds a part
still has a lambda of about 1e4 1/s: it takes hundreds of steps without motion.

Method. Only the stages of u are damped; those of other coordinates are unchanged:

    k_i = (F_i - h lambda (g_i1 k_1 + ... + g_i,i-1 k_i-1)) / (1 + g h lambda)

with F_i the rate at the i-th stage, and lambda at the start of the step, in closed form
from the model. It is a Rosenbrock W-method whose guess of the Jacobian is one entry of
its diagonal. With lambda = 0 the step is Dormand and Prince's to the last bit. With any
other lambda, exact or nearly so, it is of order 3 and its error estimate of order 2.
Between the ends of a step the damped coordinate is of order 2: damping is efficient at
an rtol of 1e-3 to 1e-5. F_7 is the F_1 of the next step, damped with its h and lambda.

Integrals. The rate g of a quadrature that depends on u follows its stages too closely:
an energy may be thousands of rtol off. With its slope dg/du at the start of the step,
from the model, its stages are g_i - (k_i - F_i) dg/du / lambda: the same method, with
one more entry in the guess of the Jacobian. Any slope keeps the order.

Limits. In the stiff limit a lambda from 0.87 to 1.4 of the true one is stable. A
smaller lambda, or one two to three times too great, is unstable as explicit steps are,
from an h lambda of a few tens; error control then shortens the steps. A lambda ten
times too great holds a moving coordinate still, and its error estimate too: the result
is wrong, and only an audit at a smaller rtol shows it. A lambda that jumps needs a mark
or a crossing at the jump. Stiffness that
couples coordinates, as of a spring, is not damped, nor is a coordinate that grows
(lambda < 0).

References
----------
E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, IV.7, Rosenbrock
methods and W-methods; the coefficients and their conditions are in `tableau`.
"""

import numpy as np

from tolstat.integrator import tableau
from tolstat.lanes.compiled import compiled

DIAGONAL = float(tableau.G_DIAGONAL)
B = np.array([float(b) for b in tableau.B])
G = np.array([[*map(float, row), *[0.0] * (7 - len(row))] for row in tableau.G])


@compiled(within=True)
def begin_damping(h, step):
    """Store lambda at the start of the step; damp K1 from its undamped rates."""
    n, K1 = len(step.damped), step.k[0]
    lambda_h, share = step.lambda_h, step.share
    undamped = len(K1) - n
    first = undamped - n * (1 + len(step.sloped))
    for j in range(n):
        declared = h * K1[first + j]
        # growing coordinates and NaN get the plain step
        lambda_h[j] = np.where((declared > 0.0) & np.isfinite(declared), declared, 0.0)
        share[j] = 1.0 / (1.0 + DIAGONAL * lambda_h[j])
        K1[step.damped[j]] = K1[undamped + j] * share[j]
    slope = step.slope
    for row in range(len(slope)):
        slope[row] = K1[first + n + row]


@compiled(within=True)
def damp(stage, step):
    """Damp the rates of a stage, counted from 0; undamped rates follow in its rows."""
    k, damped = step.k, step.damped
    n, K = len(damped), k[stage]
    for j in range(n):
        i = damped[j]
        before = G[stage, 0] * k[0][i]
        for earlier in range(1, stage):
            before = before + G[stage, earlier] * k[earlier][i]
        K[len(K) - n + j] = K[i]
        K[i] = (K[i] - step.lambda_h[j] * before) * step.share[j]


@compiled(within=True)
def damped_part(i, h, step):
    """Return what damping adds to the integral of the i-th quadrature over the step."""
    n, n_sloped, total = len(step.damped), len(step.sloped), 0.0 * h
    undamped = len(step.k[0]) - n
    for s in range(n_sloped):
        if step.sloped[s] == i:
            for j in range(n):
                lag = 0.0 * h
                for stage in range(6):
                    K = step.k[stage]
                    lag = lag + B[stage] * (K[undamped + j] - K[step.damped[j]])
                lambda_h = step.lambda_h[j]
                slope = step.slope[j * n_sloped + s]
                damps = lambda_h > 0.0
                per_lambda = np.where(damps, h, 0.0) / np.where(damps, lambda_h, 1.0)
                total = total + h * slope * per_lambda * lag
    return total
