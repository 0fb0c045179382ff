"""When limits are looked at while trials are added, and which are still undecided.

Verdicts rest on anytime-valid intervals: however often one looks, each verdict is wrong
in at most 2.5 % of runs. So looks are as near as a tenth of the trials.
"""

import math
from collections.abc import Iterator, Mapping

from tolstat.arrays import Array, Truths
from tolstat.statistics.limits.limit import Limit, within
from tolstat.statistics.limits.yields import UNDECIDED, verdict
from tolstat.statistics.sample import Sample
from tolstat.statistics.sample_size import FIRST_STAGE, STAGE_MULTIPLE, trials_needed

GROWTH = 1.1  # trials of a look over those of the look before


def looks_from(trials: int) -> Iterator[int]:
    """Yield the numbers of trials at which limits are looked at, from this number on.

    They are the same of all runs: a resumed run looks when an uninterrupted one does.
    """
    look = FIRST_STAGE
    while True:
        if look >= trials:
            yield look
        look = STAGE_MULTIPLE * math.ceil(GROWTH * look / STAGE_MULTIPLE)


def undecided(
    responses: Mapping[str, Array], sample: Sample, limits: Mapping[str, Limit]
) -> dict[str, Truths]:
    """Return the undecided limits, and which trials are within each of them."""
    units = dict[str, Truths]()
    for name, limit in limits.items():
        part = sample.telling(1 - limit.demanded)
        values = responses[name][: len(part.status)]
        good = within(values, limit.permitted) & part.done
        if part.thinned:
            from tolstat.statistics.deciding.thinned_share import is_settled  # seldom

            settled = is_settled(~good, part.thinned, 1 - limit.demanded)
        else:
            share = part.share(good, part.ran)
            settled = verdict(share, limit.demanded) != UNDECIDED
        if not settled:
            units[name] = good
    return units


def trials_that_settle(
    units: Mapping[str, Truths], sample: Sample, limits: Mapping[str, Limit]
) -> float:
    """Return how many trials are likely to decide all limits; infinite if unknown.

    `units` are those of `undecided`: 0 without any.
    """
    demands = {name: limits[name].demanded for name in units}
    needed = [
        trials_needed(good, sample.telling(1 - demands[name]), demands[name])
        for name, good in units.items()
    ]
    return max((trials or math.inf for trials in needed), default=0.0)
