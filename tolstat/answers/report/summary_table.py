"""Old names, until what-if, compare and allocate have moved."""

from __future__ import annotations

import math

from tolstat.answers.report.gather import summaries_of
from tolstat.answers.report.run_notes import notes_of
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.sample import Sample
from tolstat.store.stored_run import Run
from tolstat.units.scale import Scale

__all__ = ["Cell", "estimate_in_words", "notes_of", "reading_of", "summaries_of"]

# a text, or a number with the ends of its interval
Cell = str | tuple[str, str, str]


def estimate_in_words(estimate: Estimate, scale: Scale) -> Cell:
    """Write an estimate with its interval, or why it has none.

    Of one that is nothing to an engineer the interval says nothing more.
    """
    value, lower, upper = scale.interval(*estimate[:3])
    if estimate.sure and math.isinf(estimate.upper):
        return f"at least {lower}"
    if estimate.sure and math.isinf(estimate.lower):
        return f"at most {upper}"
    if math.isinf(estimate.value):
        return "no interval"
    if estimate.sure:
        nothing = estimate.value and scale.nothing(max(map(abs, estimate[:3])))
        return value if nothing else (value, lower, upper)
    if estimate.needs_more:
        return estimate.reason
    return f"{value}: no interval"


def reading_of(run: Run, sample: Sample | None) -> list[str]:
    """Say what stands with each number of a table for the screen."""
    if sample and not sample.replicates:
        return [
            "with each number its 95 % interval: order statistics for quantiles; of "
            "shares beyond limits it holds however often one looks while trials are "
            'added; "needs N": no interval exists with fewer trials; "N decide": with '
            "a chance of 80 %; as Ppk: of a normal response with as many beyond"
        ]
    if run.sampled:
        return [f"with each number its 95 % interval: {run.sampled.promise}"]
    return []
