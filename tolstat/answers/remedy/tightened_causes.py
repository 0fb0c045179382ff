"""Tighter tolerances of main causes, from weighted trials.

For responses that no surface explains, such as one that is zero in most trials.
"""

from collections.abc import Iterator, Sequence
from itertools import accumulate

import numpy as np

from tolstat.answers.remedy.changed_entries import ChangeableEntries, changed_entries
from tolstat.answers.sampled_trials import Drawn
from tolstat.answers.what_if.reweighted_trials import reweighted_scenario
from tolstat.errors import TolstatError
from tolstat.statistics.intervals.weighted_estimates import weighted_share
from tolstat.statistics.remedies.change import Change
from tolstat.statistics.remedies.prediction import Shares, Step
from tolstat.study.study import Study

RATIOS = 0.7, 0.5
MOST_CAUSES = 3

# contributors, the main cause first, of each limit that is not met
Causes = Sequence[Sequence[tuple[str, ...]]]


def tightened_causes(
    drawn: Drawn, study: Study, entries: ChangeableEntries, causes: Causes
) -> Iterator[Step]:
    """Yield tighter tolerances that the trials cover, the smallest change first.

    Of the main free cause of each limit, and of the first ones together.
    """
    design = entries.design
    pairs = zip(entries.members, design.free, strict=True)
    free = {name for members, is_free in pairs if is_free for name in members}
    main = [
        next((cause for cause in of_limit if not free.isdisjoint(cause)), ())
        for of_limit in causes
    ]
    single = [{*cause} for cause in dict.fromkeys(filter(None, main))][:MOST_CAUSES]
    together = accumulate(single, lambda first, second: first | second)
    for members in [*single, *[union for union in together if union not in single]]:
        for ratio in RATIOS:
            change = design.none
            for i, parts in enumerate(entries.members):
                if design.free[i] and not members.isdisjoint(parts):
                    change = change.with_entry(i, ratio=ratio)
            change = design.rounded(change)
            if not len(change.tightened):
                break
            try:
                yield Step(change, _weighted(drawn, study, entries, change))
            except TolstatError:
                break  # too few trials tell of it


def _weighted(
    drawn: Drawn, study: Study, entries: ChangeableEntries, change: Change
) -> Shares:
    run = drawn.run
    changed = changed_entries(run, entries, change)
    weights = reweighted_scenario(run, changed, study, drawn).weights
    out = [run.beyond(name)[drawn.trials] for name in run.limits]
    joint = weighted_share(np.any(out, axis=0), weights)
    return Shares(joint, tuple(weighted_share(column, weights) for column in out))
