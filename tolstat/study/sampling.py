"""Sampling of a study: how its trials are chosen, and the keys for each sampling."""

from collections.abc import Collection, Iterator
from typing import Any

from tolstat.deviations.distributions import Constant
from tolstat.deviations.draw import SAMPLERS, factors
from tolstat.deviations.names import expand
from tolstat.errors import ModelError, StudyError, allowed_names
from tolstat.statistics.sensitivity.sobol_indices import LEAST_GROUPS
from tolstat.study.deviations_section import Deviations
from tolstat.study.given_points import Points
from tolstat.study.problems import Problems
from tolstat.study.study_schema import MISSING, Document, RareEntry, read_entry

GIVEN = ("grid", "table")  # samplings whose trials are given
EXAMPLE = 'such as extra_loss = "<= 3 %"'  # a limit


def read_sampling(value: str | dict[str, Any], problems: Problems) -> tuple[str, str]:
    """Return a sampling, and the response whose limit it aims at; empty for none."""
    samplings = [*SAMPLERS, *GIVEN]
    if isinstance(value, str) and value in samplings:
        return value, ""
    with problems.noting("sampling", value):
        if isinstance(value, str):
            raise StudyError(f"no such sampling; {allowed_names(value, samplings)}")
        return "rare", read_entry(RareEntry, value, "there is").rare
    return "random", ""


def aim_of(sampling: str, name: str, limited: Collection[str], names: list[str]) -> str:
    """Return the response that a sampling aims at: named, or the only limited one.

    Empty where it aims at none.
    """
    if sampling not in SAMPLERS or not SAMPLERS[sampling].aims:
        return ""
    aims = expand(name, names) if name else list(limited)
    if name and (without := [aim for aim in aims if aim not in limited]):
        raise ModelError(
            f"{', '.join(without)}: no limit; add one to [limits], {EXAMPLE}"
        )
    if not aims:
        raise StudyError(
            f"it needs a limit; add one to [limits], {EXAMPLE}; responses: "
            f"{', '.join(names)}"
        )
    if len(aims) > 1:
        raise StudyError(
            f"it needs one limit, and there are {len(aims)}: {', '.join(aims)}; "
            f'name one, such as sampling = {{ {sampling} = "{aims[0]}" }}'
        )
    return aims[0]


def faults_of(
    document: Document, sampling: str, deviating: Deviations, points: Points | None
) -> Iterator[tuple[str, Any, str]]:
    """Yield keys that are missing for a sampling, or have no meaning for it.

    Each with its value, None for a missing one, and the problem.
    """
    for key, needed in (("grid", "grid"), ("table", "table"), ("[reference]", "grid")):
        if getattr(document, key.strip("[]")) and sampling != needed:
            yield key, None, f'it needs sampling = "{needed}"'
    if sampling == "grid" and not document.grid:
        yield "[grid]", None, "missing; give contributors or settings, and their values"
    if sampling == "table" and not document.table:
        yield "table", None, 'missing; such as table = "machines.csv"'
    if sampling in GIVEN:
        yield from _faults_of_given(document, sampling, deviating, points)
        return
    sampler, varying = SAMPLERS[sampling], varying_in(deviating)
    usual = sampler.usual_trials(varying)
    if document.trials is None:
        missing = f"missing; such as trials = {usual}" if usual else MISSING["trials"]
        yield "trials", None, missing
    if document.seed is None:
        yield "seed", None, MISSING["seed"]
    if isinstance(document.trials, dict) and not sampler.extensible:
        number = f"give one, such as trials = {usual}," if usual else "give one"
        yield (
            "trials",
            document.trials,
            (
                f'sampling = "{sampling}" needs a fixed number of trials; {number} or '
                'sampling = "random" or "sobol" for a stopping rule'
            ),
        )
    if sampler.group(varying) > 1 and document.correlation:
        independent = "needs deviations that are independent"
        yield "[correlation]", None, f'sampling = "{sampling}" {independent}'


def _faults_of_given(
    document: Document, sampling: str, deviating: Deviations, points: Points | None
) -> Iterator[tuple[str, Any, str]]:
    """Yield keys that trials of a grid or a table cannot have."""
    none = f'sampling = "{sampling}" samples nothing'
    for key in ("trials", "seed"):
        if (value := getattr(document, key)) is not None:
            yield key, value, f"{none}; leave it out"
    if document.correlation:
        yield "[correlation]", None, none
    taken = {m for axis in points.swept for m in axis.members} if points else set()
    for name, distribution in deviating.distributions.items():
        if not isinstance(distribution, Constant):
            only = f'{none}; only distribution = "constant" is allowed'
            yield f"[deviations] {name}", None, only
        elif name in taken:
            yield f"[deviations] {name}", None, "is also in [grid]; give it once"


def varying_in(deviating: Deviations) -> int:
    """Return the number of independent factors."""
    return len(factors(deviating.distributions, deviating.dependence))


def warnings_of(sampling: str, trials: int, varying: int) -> tuple[str, ...]:
    """Return the warnings about a study before it is run."""
    if varying == 0 and trials > 1:
        return (
            f"nothing deviates: all {trials} trials are equal, and their intervals "
            "have no meaning; give [deviations]",
        )
    sampler = SAMPLERS[sampling]
    group = sampler.group(varying)
    if group > 1 and trials < (least := LEAST_GROUPS * group):
        return (
            f"there will be no Sobol' indices: they need {LEAST_GROUPS} groups of "
            f"{group} trials; give trials = {least} or more ({trials} are "
            f"{trials // group} groups)",
        )
    return sampler.warnings(trials, varying)
