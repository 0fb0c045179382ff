"""How the machines of a study are chosen: what goes with which sampling."""

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
from tolstat.deviations.samplers.rare import safe_trials
from tolstat.errors import ModelError, StudyError, allowed_names
from tolstat.study.deviations_section import Deviations
from tolstat.study.given_points import Points
from tolstat.study.problems import Problems
from tolstat.study.study_schema import MISSING, Document

GIVEN = ("grid", "table")  # samplings that draw nothing
GROUPED = "saltelli"
RARE = "rare"
LEAST_RARE = 5000  # trials, to be sought with and to tell the share
PLENTY_RARE = 20_000
EXAMPLE = 'such as extra_loss = "<= 3 %"'  # a limit


def sampler_of(sampling: str) -> Sampler:
    """Return the sampler of a name."""
    found: Sampler = find_in(samplers, sampling)()
    return found


def read_sampling(document: Document, problems: Problems) -> tuple[Document, str]:
    """Read a sampling that says of which response it is asked.

    Returned are the study with the name of the sampling alone, and the response that `{
    rare = "..." }` names, empty where none is named.
    """
    given = document.sampling
    if isinstance(given, str):
        return document, ""
    with problems.noting("sampling", given):
        for key in given:
            if key != RARE:
                raise StudyError(f"no key {key}; {allowed_names(key, (RARE,))}")
        name = given.get(RARE)
        if not isinstance(name, str) or not name:
            example = next(iter(document.limits), "extra_loss")
            raise StudyError(
                f'a response with a limit is expected, such as {{ rare = "{example}" }}'
            )
        return replace(document, sampling=RARE), name
    return replace(document, sampling="random"), ""


def rare_response(name: str, limited: Collection[str], known: list[str]) -> str:
    """Return the response of a rare study: the one named, or the only limited one."""
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
            f'name one, such as sampling = {{ rare = "{asked[0]}" }}'
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
            missing = MISSING[key]
            if key == "trials" and sampling == RARE:
                missing = f"missing; such as trials = {plenty(_varying(deviating))}"
            problems.add(key, None, missing)
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
    sampling = str(document.sampling)
    if isinstance(document.trials, dict):
        sampler = sampler_of(sampling)
        if not sampler.extensible:
            number = "give one"
            if sampling == RARE:
                number += f", such as trials = {plenty(_varying(deviating))},"
            problems.add(
                "trials", document.trials,
                f'sampling = "{sampling}" is made for a number of trials; {number} or '
                'sampling = "random" or "sobol", which until needs',
            )  # fmt: skip
    if sampling == GROUPED and document.correlation:
        problems.add(
            "[correlation]", None,
            f'sampling = "{sampling}" needs deviations that are independent',
        )  # fmt: skip


def check_trials(trials: int, sampling: str, deviating: Deviations) -> str:
    """Return what is wrong with a number of trials; empty if nothing is.

    What deviates decides how many trials belong together.
    """
    varying = _varying(deviating)
    if sampling == RARE and not varying:
        return (
            "nothing deviates: no machine is rare; give a line in [deviations], such "
            'as rod_length = "+-1.2 mm", or a link its tolerance'
        )
    if sampling == RARE and trials < LEAST_RARE:
        return (
            f'sampling = "rare" needs {LEAST_RARE} trials or more: 3 of 5 are to '
            f"find the machines beyond; {plenty(varying)} are plenty"
        )
    group = sampler_of(sampling).group(varying)
    if trials % group == 0:
        return ""
    below = trials // group * group
    near = " or ".join(str(n) for n in (below, below + group) if n)
    return (
        f"a multiple of {group} is expected, {varying} contributors that deviate and 2 "
        f"for each point: {near}"
    )


def _varying(deviating: Deviations) -> int:
    """Count what varies independently."""
    return len(factors(deviating.distributions, deviating.dependence))


def plenty(varying: int) -> int:
    """Return with how many trials so many deviations are sought and told well."""
    return max(PLENTY_RARE, safe_trials(varying))


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
