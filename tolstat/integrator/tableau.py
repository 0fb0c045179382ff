"""The constants of Dormand and Prince's 5(4) pair, and of its linear damping.

All are exact fractions.

References
----------
J. R. Dormand, P. J. Prince, A family of embedded Runge-Kutta formulae, J. Comput.
Appl. Math. 6 (1980) 19-26; the interpolant is L. F. Shampine's (Math. Comp. 46 (1986)
135-150), the one of SciPy's RK45.
"""

from fractions import Fraction as F

C = (F(0), F(1, 5), F(3, 10), F(4, 5), F(8, 9), F(1), F(1))

A = (
    (),
    (F(1, 5),),
    (F(3, 40), F(9, 40)),
    (F(44, 45), F(-56, 15), F(32, 9)),
    (F(19372, 6561), F(-25360, 2187), F(64448, 6561), F(-212, 729)),
    (F(9017, 3168), F(-355, 33), F(46732, 5247), F(49, 176), F(-5103, 18656)),
    (F(35, 384), F(0), F(500, 1113), F(125, 192), F(-2187, 6784), F(11, 84)),
)

# order 5: the last stage is the first of the next step
B = (*A[6], F(0))

# order 4
B_EMBEDDED = (
    F(5179, 57600), F(0), F(7571, 16695), F(393, 640), F(-92097, 339200),
    F(187, 2100), F(1, 40),
)  # fmt: skip

E = tuple(high - low for high, low in zip(B, B_EMBEDDED, strict=True))

# Linear damping of one coordinate inside the step, see `damping`: with G_DIAGONAL on
# the diagonal of G and gamma its row sums,
#   b . gamma = 0                                  order 2, whatever lambda
#   b A gamma = b G c = b G gamma = 0              order 3, whatever lambda
#   b^ . gamma = 0                                 the error estimate's order 2
#   1 - b (A + G)^-1 1 = 0                         the stiff limit, of stages 1 to 6
# Solved exactly for the first entry of rows 5 and 7 and the first four of row 6; the
# others are chosen: no stage of u' = -lambda u, lambda real, exceeds its start.
G_DIAGONAL = F(3, 20)
G = (
    (),
    (F(-1, 8),),
    (F(17, 1000), F(-101, 500)),
    (F(13, 1000), F(53, 500), F(-273, 1000)),
    (F(10363, 40500), F(-28, 125), F(-77, 125), F(247, 500)),
    (
        F(155243566336576763, 436173208911000000),
        F(-165302026237807739, 436173208911000000),
        F(-522608058574401193, 872346417822000000),
        F(101034886060123229, 174469283564400000), F(19, 250),
    ),
    (F(329, 18000), F(-1, 500), F(-27, 1000), F(-3, 1000), F(7, 500), F(21, 500)),
)  # fmt: skip

# weight of stage i at the fraction theta of a step: sum over j of
# DENSE[i][j] theta^(j+1), of order 4
DENSE = (
    (F(1), F(-8048581381, 2820520608), F(8663915743, 2820520608),
     F(-12715105075, 11282082432)),
    (F(0), F(0), F(0), F(0)),
    (F(0), F(131558114200, 32700410799), F(-68118460800, 10900136933),
     F(87487479700, 32700410799)),
    (F(0), F(-1754552775, 470086768), F(14199869525, 1410260304),
     F(-10690763975, 1880347072)),
    (F(0), F(127303824393, 49829197408), F(-318862633887, 49829197408),
     F(701980252875, 199316789632)),
    (F(0), F(-282668133, 205662961), F(2019193451, 616988883),
     F(-1453857185, 822651844)),
    (F(0), F(40617522, 29380423), F(-110615467, 29380423), F(69997945, 29380423)),
)  # fmt: skip


def dense_weights(theta: F) -> tuple[F, ...]:
    """Return the weights of the seven stages for the state inside a step.

    Parameters
    ----------
    theta : Fraction
        Fraction of the step, 0 to 1.

    Returns
    -------
    tuple of Fraction
        y(t + theta h) = y(t) + h times the sum of weight times stage.
    """
    return tuple(
        sum((w * theta ** (j + 1) for j, w in enumerate(row)), F(0)) for row in DENSE
    )
