"""Integration errors, from the trials of a run that were evaluated again."""

import math

import numpy as np
from numpy.typing import NDArray

from tolstat.answers.report.report_answer import Effect, IntegrationErrors, LargestError
from tolstat.answers.sampled_trials import Drawn, changes_of
from tolstat.arrays import Array
from tolstat.statistics.integration_error import (
    integration_error,
    share_above_largest,
)
from tolstat.statistics.intervals.statistic import quantiles_at
from tolstat.statistics.limits.yields import yield_of
from tolstat.statistics.summary import Summary
from tolstat.status import Status
from tolstat.store.run_records import Reason


def integration_of(drawn: Drawn, name: str, of: Summary) -> IntegrationErrors | None:
    """Return the integration errors of a response, and their effect on its numbers.

    None where nothing was evaluated again.
    """
    run, audited = drawn.run, drawn.run.audited
    if audited is None:
        return None
    ran = (audited.status == Status.DONE) & (run.status[audited.trials] == Status.DONE)
    precise = np.where(ran, audited.responses[name], np.nan)
    reasons = audited.chosen_by.get(name, np.zeros(len(ran), np.uint8))
    values, random = run.column(name), audited.at_random
    error = integration_error(values, audited.trials, precise, random | (reasons > 0))

    def largest(some: NDArray[np.bool_]) -> LargestError:
        own = error.of(audited.trials[some])
        return LargestError(len(own.trials), own.largest)

    # statements about production need independent trials
    at_random = largest(random & np.isin(audited.trials, drawn.trials))
    chosen = {str(r.name).lower(): (reasons & r) > 0 for r in Reason}
    above = share_above_largest(at_random.trials)
    known = len(error.trials) > 0
    return IntegrationErrors(
        len(audited.trials), error.failed, audited.settings, error.largest, at_random,
        math.nan if drawn.sample.replicates else above,
        {reason: largest(some) for reason, some in chosen.items() if some.any()},
        _effect(drawn, error.removed(values)[drawn.trials], of) if known else None,
        int(np.count_nonzero(changes_of(run, name))) if of.limited else None,
    )  # fmt: skip


def _effect(drawn: Drawn, better: Array, of: Summary) -> Effect:
    sample, limited = drawn.sample, of.limited
    done, moved = better[sample.done], None
    sigma = float(done.std(ddof=1)) if len(done) > 1 else math.nan
    limit = limited.limit.permitted if limited else None
    quantiles = quantiles_at(better, sample, [*of.quantiles], limit)
    if limited:
        again = yield_of(better, sample, limited.limit.permitted).fraction_out_of_limit
        moved = limited.yields.fraction_out_of_limit.value - again.value
    return Effect(
        of.mean.value - float(done.mean()),
        of.sigma.value - sigma,
        {share: of.quantiles[share].value - q.value for share, q in quantiles.items()},
        moved,
    )
