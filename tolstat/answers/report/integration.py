"""Integration errors, from the trials of a run that were evaluated again."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from tolstat.answers.report.report_answer import Effect, IntegrationErrors, LargestError
from tolstat.answers.sampled_trials import Drawn, audited_of
from tolstat.arrays import Array
from tolstat.statistics.integration_error import (
    IntegrationError,
    VerdictChanges,
    integration_error,
    share_above_largest,
    verdict_changes,
)
from tolstat.statistics.intervals.statistic import quantiles_at
from tolstat.statistics.limits.yields import yield_of
from tolstat.statistics.summary import Summary
from tolstat.store.run_records import Reason


def integration_of(drawn: Drawn, name: str, of: Summary) -> IntegrationErrors | None:
    """Return the integration errors of a response, and their effect on its numbers.

    None where nothing was evaluated again.
    """
    audited, found = drawn.run.audited, audited_of(drawn.run, name)
    if audited is None or found is None:
        return None
    error, values, random = integration_error(*found), found[0], audited.at_random
    reasons = audited.chosen_by.get(name, np.zeros(len(random), np.uint8))

    def largest(some: NDArray[np.bool_]) -> LargestError:
        own = error.of(audited.trials[some])
        return LargestError(len(own.trials), own.largest)

    # statements about production need independent trials
    at_random = largest(random & np.isin(audited.trials, drawn.trials))
    chosen = {str(r.name).lower(): (reasons & r) > 0 for r in Reason}
    limit = of.limited.limit.permitted if of.limited else None
    above = share_above_largest(at_random.trials)
    known = len(error.trials) > 0
    return IntegrationErrors(
        len(audited.trials), error.failed, audited.settings, error.largest, at_random,
        math.nan if drawn.sample.replicates else above,
        {reason: largest(some) for reason, some in chosen.items() if some.any()},
        _effect(drawn, error.removed(values)[drawn.trials], of) if known else None,
        _sides(drawn, error, values, limit) if limit else None,
    )  # fmt: skip


def _effect(drawn: Drawn, better: Array, of: Summary) -> Effect:
    sample, limited = drawn.sample, of.limited
    done, moved = better[sample.done], None
    sigma = float(done.std(ddof=1)) if len(done) > 1 else math.nan
    limit = limited.limit.permitted if limited else None
    quantiles = quantiles_at(better, sample, of.quantiles, limit)
    if limited:
        again = yield_of(better, sample, limited.limit.permitted).fraction_out_of_limit
        moved = limited.yields.fraction_out_of_limit.value - again.value
    return Effect(
        of.mean.value - float(done.mean()),
        of.sigma.value - sigma,
        {share: of.quantiles[share].value - q.value for share, q in quantiles.items()},
        moved,
    )


def _sides(
    drawn: Drawn, error: IntegrationError, values: Array, limit: tuple[float, float]
) -> VerdictChanges:
    """Return changes of side among the trials that the statistics rest on."""
    counted = np.full_like(values, np.nan)
    counted[drawn.trials] = values[drawn.trials]
    own = error.of(drawn.trials)
    return verdict_changes(counted, own.trials, values[own.trials] - own.errors, limit)
