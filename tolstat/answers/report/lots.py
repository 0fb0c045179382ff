"""Performance within lots: without the share of the variance between them."""

import math
from collections.abc import Sequence

from tolstat.deviations.names import means_of_lots
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.sensitivity.contributions import Contributions
from tolstat.statistics.summary import Performance

WITHIN_LOTS = "within lots, by moments"
BY_SHARES = "by the contributions of lots"


def within_lots(
    overall: Performance, contributions: Contributions | None, names: Sequence[str]
) -> Performance | None:
    """Return Pp and Ppk of the parts of one lot; None if no contributor is one's mean.

    The variance within lots is that of all trials less the contributions of the means
    of lots, each alone.
    """
    shares = contributions.first_order if contributions else {}
    between = [shares[name].value for name in means_of_lots(names) if name in shares]
    if not between:
        return None
    within = 1 - math.fsum(between)
    ratio = 1 / math.sqrt(within) if within > 0 else math.nan

    def alone(index: Estimate) -> Estimate:
        return Estimate(index.value * ratio, reason=BY_SHARES)

    return Performance(*map(alone, overall))
