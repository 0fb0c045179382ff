"""What a study will not tell, though it can be run."""

from __future__ import annotations

from tolstat.deviations.samplers.rare import safe_trials
from tolstat.statistics.sensitivity.sobol_indices import LEAST
from tolstat.study.sampling import GROUPED, RARE, sampler_of


def doubts_of(sampling: str, trials: int, factors: int) -> tuple[str, ...]:
    """Say before a study is run what it will not tell."""
    if factors == 0 and trials > 1:
        return (
            f"nothing deviates: all {trials} trials are one and the same machine, "
            "nothing spreads and no interval means anything; give [deviations]",
        )
    group = sampler_of(sampling).group(factors)
    if sampling == GROUPED and trials < LEAST * group:
        return (
            f"there will be no Sobol' indices: they need {LEAST} groups of {group} "
            f"trials, trials = {LEAST * group} or more, and {trials} are "
            f"{trials // group} groups",
        )
    if sampling == RARE and trials < (safe := safe_trials(factors)):
        return (
            f"of several kinds of machines beyond a smaller one may be lost among "
            f"{factors} deviations with {trials} trials, and the interval is then of "
            f"the others: trials = {safe} or more look for it",
        )
    return ()
