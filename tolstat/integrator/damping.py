"""Linear damping of stiff coordinates inside the step of Dormand and Prince.

Why. An explicit step h is stable only to h lambda = 3.3, where lambda = -dF/du >= 0 is
the rate at which a coordinate u, du/dt = F(t, y), relaxes. Friction that holds a part
still has a lambda of some 1e4 1/s: hundreds of steps in which nothing happens.

What. The stages of u alone are damped, every other coordinate's are as ever:

    k_i = (F_i - h lambda (g_i1 k_1 + ... + g_i,i-1 k_i-1)) / (1 + g h lambda)

with F_i the rate at the i-th stage and lambda that of the start of the step, from the
machine, in closed form. It is a Rosenbrock W-method whose guess of the Jacobian is one
entry of its diagonal: a wrong lambda costs steps, not order. With lambda = 0 the step
is Dormand and Prince's to the last bit; with another it is of order 3, its error
estimate of order 2. F_7 is the F_1 of the next step, damped anew with that step's h and
lambda.

Where it may fail. A lambda far below the true one, where h lambda is in the thousands:
unstable, as explicit steps are; error control then shortens them. Stiffness that
couples coordinates, a spring's, is not damped; nor is one with lambda < 0, which grows.

References
----------
E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, IV.7, Rosenbrock
methods and W-methods; the coefficients and their conditions stand in `tableau`.
"""

from __future__ import annotations

import numpy as np

from tolstat.integrator import tableau
from tolstat.lanes.compiled import compiled
from tolstat.lanes.rows import rows

G = float(tableau.G_DIAGONAL)
G21 = float(tableau.G[1][0])
G31, G32 = (float(g) for g in tableau.G[2])
G41, G42, G43 = (float(g) for g in tableau.G[3])
G51, G52, G53, G54 = (float(g) for g in tableau.G[4])
G61, G62, G63, G64, G65 = (float(g) for g in tableau.G[5])
G71, G72, G73, G74, G75, G76 = (float(g) for g in tableau.G[6])


@compiled(within=True)
def begin_damping(h, k, damping):
    """Take the lambda of the start of the step, the last of its rates; damp K1."""
    K1, first = rows(k[0]), rows(damping.first)
    lambda_h, share = rows(damping.lambda_h), rows(damping.share)
    lambdas = len(K1) - len(damping.states)
    for j in range(len(damping.states)):
        rate = K1[lambdas + j]
        # what grows, or is no number, is left to the plain step
        rate = np.where((rate > 0.0) & np.isfinite(rate), rate, 0.0)
        lambda_h[j] = h * rate
        share[j] = 1.0 / (1.0 + G * (h * rate))
        K1[damping.states[j]] = first[j] * share[j]


@compiled(within=True)
def damp(K, i, j, before, damping):
    """Damp the i-th rate of a stage, the j-th that is; of the last stage F is kept.

    `before` is what the stages before it give, weighed by their g.
    """
    lambda_h, share = rows(damping.lambda_h), rows(damping.share)
    rows(damping.last)[j] = K[i]
    K[i] = (K[i] - lambda_h[j] * before) * share[j]
