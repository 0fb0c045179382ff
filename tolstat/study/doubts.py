"""What a study will not tell, though it can be run."""

from __future__ import annotations

from tolstat.statistics.total_indices import LEAST
from tolstat.study.sampling import GROUPED, sampler_of


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
    return ()
