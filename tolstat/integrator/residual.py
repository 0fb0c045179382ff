"""The largest residual of a surveyed integration: what its steps jumped over."""

from collections.abc import Iterable

import numpy as np

from tolstat.integrator.integrate import Integration
from tolstat.integrator.problem import PLACE, RESIDUAL, SIZE, Residual

# times as large are residuals of smooth rates that follow a damped state, whose dense
# output is of order 2: 300 rtol were seen in a stand without any kink, 630 at an rtol
# of 1e-7, where friction turns. Without all rows that depend on its damped state, three
# of its eight states would be left, and no force
DAMPED = 10.0


def largest_residual(integrations: Iterable[Integration]) -> Residual | None:
    """Return the largest residual of surveyed integrations; None without any.

    That of a quadrature is related to its largest value. Damped states, and quadratures
    that depend on them, are left out: the dense output does not follow them. With them
    a residual counts as a tenth.
    """
    largest = None
    for system, block, solution in integrations:
        survey, states = solution.survey, len(system.scale)
        if not survey.size:
            continue
        with np.errstate(all="ignore"):
            end = np.nanmax(np.abs(solution.quadratures), axis=1, initial=0.0)
        sizes = np.broadcast_to(system.scale, (len(survey), states))
        sizes = np.hstack([sizes, np.fmax(survey[:, states:, SIZE], end)])
        residuals = np.divide(
            survey[:, :, RESIDUAL],
            block.accuracy.rtol * sizes,
            out=np.zeros(sizes.shape),
            where=sizes > 0.0,
        )
        residuals[:, [*system.damped, *(states + i for i in system.sloped)]] = 0.0
        residuals /= DAMPED if system.damped else 1.0
        trial, row = np.unravel_index(np.argmax(residuals), residuals.shape)
        size = float(residuals[trial, row])
        if largest is None or size > largest.of_rtol:
            time = float(survey[trial, row, PLACE])
            largest = Residual(size, time, int(row), states)
    return largest
