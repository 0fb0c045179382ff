"""Linear damping of stiff coordinates inside the step of Dormand and Prince.

Why. The explicit step h is stable only to h lambda = 3.3, where lambda = -dF/du >= 0
is the rate at which a coordinate u, du/dt = F(t, y), relaxes. Friction that holds a
part still has a lambda of some 1e4 1/s: hundreds of steps in which nothing happens.

What. The stages of u alone are damped, every other coordinate's are as ever:

    k_i = (F_i - h lambda (g_i1 k_1 + ... + g_i,i-1 k_i-1)) / (1 + g h lambda)

with F_i the rate at the i-th stage and lambda that of the start of the step, from the
machine, in closed form. It is a Rosenbrock W-method whose guess of the Jacobian is one
entry of its diagonal. With lambda = 0 the step is Dormand and Prince's to the last bit;
with another, right or a little wrong, it is of order 3, its error estimate of order 2,
and between the ends of a step the damped coordinate is of order 2: it pays at an rtol
of 1e-3 to 1e-6. F_7 is the F_1 of the next step, damped again with its h and lambda.

Where it may fail. In the stiff limit a lambda from 0.87 to 1.4 of the true one is
stable. One that is smaller, or twice to thrice too great, is unstable as explicit steps
are, from an h lambda of some tens on; error control then shortens the steps. One that
is ten times too great and more holds still what should move, and the error estimate
with it: the answer is wrong, and nothing tells. A lambda that jumps needs a mark where
it does. Stiffness that couples coordinates, a spring's, is not damped; nor is one with
lambda < 0, which grows.

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

DIAGONAL = float(tableau.G_DIAGONAL)
G = np.array([[*map(float, row), *[0.0] * (7 - len(row))] for row in tableau.G])


@compiled(within=True)
def begin_damping(h, step):
    """Take the lambda of the start of the step; damp K1 by what it was undamped."""
    n, K1 = len(step.damped), rows(step.k[0])
    lambda_h, share = rows(step.lambda_h), rows(step.share)
    undamped = len(K1) - n
    for j in range(n):
        given = h * K1[undamped - n + j]
        # what grows, or is no number, is left to the plain step
        lambda_h[j] = np.where((given > 0.0) & np.isfinite(given), given, 0.0)
        share[j] = 1.0 / (1.0 + DIAGONAL * lambda_h[j])
        K1[step.damped[j]] = K1[undamped + j] * share[j]


@compiled(within=True)
def damp(stage, step):
    """Damp the rates of a stage, counted from 0; what they were follows in its rows."""
    n, K = len(step.damped), rows(step.k[stage])
    lambda_h, share = rows(step.lambda_h), rows(step.share)
    undamped = len(K) - n
    for j in range(n):
        i = step.damped[j]
        before = G[stage, 0] * rows(step.k[0])[i]
        for earlier in range(1, stage):
            before = before + G[stage, earlier] * rows(step.k[earlier])[i]
        K[undamped + j] = K[i]
        K[i] = (K[i] - lambda_h[j] * before) * share[j]
