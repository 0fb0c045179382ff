"""What a run says about each response, in one row."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.statistics.proportions import Proportion, proportion
from tolstat.statistics.quantiles import Quantile, quantile
from tolstat.status import Status

SHARES = (0.5, 0.05, 0.95, 0.99)


class Summary(NamedTuple):
    """One response over all trials that were run.

    Attributes
    ----------
    quantiles : tuple of Quantile
        At `SHARES`, of the trials that are done.
    beyond : Proportion or None
        Share of trials beyond the limit, failed ones among them; None without limit.
    """

    quantiles: tuple[Quantile, ...]
    beyond: Proportion | None


def summarize(
    values: NDArray[np.float64],
    status: NDArray[np.integer],
    limit: tuple[float, float] | None = None,
) -> Summary:
    """Summarize a response.

    Parameters
    ----------
    values : float64[trial]
        The response; NaN in trials that are not done.
    status : int[trial]
        Values of `Status`.
    limit : tuple of float, optional
        Least and greatest permitted value.

    Returns
    -------
    Summary
        Every number with its 95 % interval.
    """
    done = values[status == Status.DONE]
    run = int(np.count_nonzero(status != Status.NOT_RUN))
    beyond = None
    if limit is not None and run > 0:
        lower, upper = limit
        within = int(np.count_nonzero((done >= lower) & (done <= upper)))
        beyond = proportion(run - within, run)  # a machine that failed counts against
    return Summary(tuple(quantile(done, share) for share in SHARES), beyond)
