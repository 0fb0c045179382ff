"""Performance within lots: without the share of the variance between them."""

import math

from tolstat.deviations.names import LOT
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.sensitivity.contributions import Contributions
from tolstat.statistics.summary import Performance

WITHIN_LOTS = "within lots, by moments"
BY_SHARES = "by the contributions of lots"


def within_lots(
    overall: Performance, contributions: Contributions | None
) -> Performance | None:
    """Return Pp and Ppk of the parts of one lot; None without lots.

    The variance within lots is that of all trials less the contributions of the means
    of lots, each alone.
    """
    shares = contributions.first_order if contributions else {}
    between = [share.value for name, share in shares.items() if name.endswith(LOT)]
    if not between:
        return None
    within = 1 - math.fsum(between)
    ratio = 1 / math.sqrt(within) if within > 0 else math.nan

    def alone(index: Estimate) -> Estimate:
        return Estimate(index.value * ratio, reason=BY_SHARES)

    return Performance(*map(alone, overall))
