"""How the trials of a study are chosen: what goes with which sampling."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from typing import Any

from tolstat.deviations import samplers
from tolstat.deviations.distributions.constant import Constant
from tolstat.deviations.draw import factors
from tolstat.deviations.names import expand
from tolstat.deviations.parts import find_in, names_in
from tolstat.deviations.samplers import Sampler
from tolstat.errors import ModelError, StudyError, allowed_names
from tolstat.study.deviations_section import Deviations
from tolstat.study.given_points import Points
from tolstat.study.problems import Problems
from tolstat.study.study_schema import MISSING, Document

GIVEN = ("grid", "table")  # samplings that draw nothing
EXAMPLE = 'such as extra_loss = "<= 3 %"'  # a limit


def sampler_of(sampling: str) -> Sampler:
    """Return the sampler of a name."""
    found: Sampler = find_in(samplers, sampling)()
    return found


def read_sampling(document: Document, problems: Problems) -> tuple[Document, str]:
    """Read a sampling that may name the response at whose limit it aims.

    Returned are the study with the name of the sampling alone, and the response that
    `{ rare = "..." }` names, empty where none is named.
    """
    given = document.sampling
    if isinstance(given, str):
        return document, ""
    with problems.noting("sampling", given):
        aiming = [name for name in names_in(samplers) if sampler_of(name).aims]
        for key in given:
            if key not in aiming:
                raise StudyError(f"no key {key}; {allowed_names(key, aiming)}")
        if len(given) != 1:
            raise StudyError(f"one of {', '.join(aiming)} is expected")
        ((sampling, name),) = given.items()
        if not isinstance(name, str) or not name:
            example = next(iter(document.limits), "extra_loss")
            raise StudyError(
                "a response with a limit is expected, such as "
                f'{{ {sampling} = "{example}" }}'
            )
        return replace(document, sampling=sampling), name
    return replace(document, sampling="random"), ""


def aim_of(sampling: str, name: str, limited: Collection[str], known: list[str]) -> str:
    """Return the response that a sampling aims at: named, or the only limited one.

    Empty where it aims at none.
    """
    if sampling not in names_in(samplers) or not sampler_of(sampling).aims:
        return ""
    asked = expand(name, known) if name else list(limited)
    if name and (without := [each for each in asked if each not in limited]):
        raise ModelError(
            f"{', '.join(without)}: no limit; give it a line in [limits], {EXAMPLE}"
        )
    if not asked:
        raise StudyError(
            f"it is for a limit; give one in [limits], {EXAMPLE}; responses: "
            f"{', '.join(known)}"
        )
    if len(asked) > 1:
        raise StudyError(
            f"it is for one limit, and there are {len(asked)}: {', '.join(asked)}; "
            f'name one, such as sampling = {{ {sampling} = "{asked[0]}" }}'
        )
    return asked[0]


def check_sampling(
    document: Document,
    deviating: Deviations,
    points: Points | None,
    problems: Problems,
) -> None:
    """Refuse keys that are missing for a sampling as read, or say nothing to it."""
    sampling = str(document.sampling)
    known = [*names_in(samplers), *GIVEN]
    if sampling not in known:
        allowed = allowed_names(sampling, known)
        problems.add("sampling", sampling, f"no such sampling; {allowed}")
        return
    drawn = sampling not in GIVEN
    for key in ("trials", "seed"):
        value = getattr(document, key)
        if drawn and value is None:
            usual = sampler_of(sampling).usual_trials(_varying(deviating))
            said = f"missing; such as trials = {usual}" if usual else MISSING["trials"]
            problems.add(key, None, said if key == "trials" else MISSING[key])
        elif not drawn and value is not None:
            problems.add(key, value, f'sampling = "{sampling}" draws nothing; leave it')
    for key in GIVEN:
        value = getattr(document, key)
        if value and sampling != key:
            problems.add(key, None, f'it needs sampling = "{key}"')
    if sampling == "table" and not document.table:
        problems.add("table", None, 'missing; such as table = "machines.csv"')
    if document.reference and sampling != "grid":
        problems.add("[reference]", None, 'it needs sampling = "grid"')
    if drawn:
        _check_drawn(document, deviating, problems)
    else:
        _check_given(document, deviating, points, problems)


def _check_drawn(document: Document, deviating: Deviations, problems: Problems) -> None:
    sampling, varying = str(document.sampling), _varying(deviating)
    sampler = sampler_of(sampling)
    if isinstance(document.trials, dict) and not sampler.extensible:
        usual = sampler.usual_trials(varying)
        number = f"give one, such as trials = {usual}," if usual else "give one"
        problems.add(
            "trials", document.trials,
            f'sampling = "{sampling}" is made for a number of trials; {number} or '
            'sampling = "random" or "sobol", which until needs',
        )  # fmt: skip
    if sampler.group(varying) > 1 and document.correlation:
        problems.add(
            "[correlation]", None,
            f'sampling = "{sampling}" needs deviations that are independent',
        )  # fmt: skip


def check_trials(trials: int, sampling: str, deviating: Deviations) -> str:
    """Return what is wrong with a number of trials; empty if nothing is."""
    return sampler_of(sampling).unfit(trials, _varying(deviating))


def _varying(deviating: Deviations) -> int:
    """Count what varies independently."""
    return len(factors(deviating.distributions, deviating.dependence))


def _check_given(
    document: Document,
    deviating: Deviations,
    points: Points | None,
    problems: Problems,
) -> None:
    sampling = str(document.sampling)
    if document.correlation:
        problems.add("[correlation]", None, f'sampling = "{sampling}" draws nothing')
    taken = {m for axis in points.swept for m in axis.members} if points else set()
    held: dict[str, Any] = dict(deviating.distributions)
    for name, distribution in held.items():
        if not isinstance(distribution, Constant):
            message = (
                f'sampling = "{sampling}" draws nothing; only distribution = '
                '"constant" goes with it'
            )
            problems.add(f"[deviations] {name}", None, message)
        elif name in taken:
            problems.add(f"[deviations] {name}", None, "stands in [grid] already")
