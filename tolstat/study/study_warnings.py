"""What a study will not tell, though it can be run."""

from __future__ import annotations

from tolstat.statistics.sensitivity.sobol_indices import LEAST
from tolstat.study.sampling import sampler_of


def doubts_of(sampling: str, trials: int, factors: int) -> tuple[str, ...]:
    """Say before a study is run what it will not tell."""
    if factors == 0 and trials > 1:
        return (
            f"nothing deviates: all {trials} trials are one and the same machine, "
            "nothing spreads and no interval means anything; give [deviations]",
        )
    sampler = sampler_of(sampling)
    group = sampler.group(factors)
    if group > 1 and trials < LEAST * group:
        return (
            f"there will be no Sobol' indices: they need {LEAST} groups of {group} "
            f"trials, trials = {LEAST * group} or more, and {trials} are "
            f"{trials // group} groups",
        )
    return sampler.warnings(trials, factors)
