"""Warnings of a report: what a reader has to know before any verdict."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import NamedTuple

from tolstat.answers.sampled_trials import Drawn
from tolstat.document import blocks
from tolstat.document.inline import Name, Number, Parts, listed, say, text
from tolstat.store.stored_run import Run
from tolstat.units.scale import Scale


class StudyWarning(NamedTuple):
    """A warning of the study or of its model, known before any trial ran."""

    sentence: str
    kind: str = "study"


class IdleContributors(NamedTuple):
    """Contributors that deviate and change no response."""

    contributors: tuple[str, ...]
    kind: str = "idle contributors"


class UnchangedResponse(NamedTuple):
    """A limited response that no deviation changes."""

    response: str
    value: float  # of all its trials, SI
    kind: str = "unchanged response"


ReportWarning = StudyWarning | IdleContributors | UnchangedResponse


def warnings_of(drawn: Drawn) -> tuple[ReportWarning, ...]:
    """Return the warnings about a run whose trials were sampled."""
    return (
        *warnings_of_run(drawn.run),
        *(
            UnchangedResponse(name, float(drawn.done(name)[0]))
            for name in drawn.run.limits
            if _unchanged(drawn, name)
        ),
    )


def warnings_of_run(run: Run) -> tuple[ReportWarning, ...]:
    """Return the warnings about any run, whatever its sampling."""
    named = " ".join(run.warnings)  # by the model, which knows why they are idle
    idle = [n for n in run.diagnostics.idle if not re.search(rf"\b{n}\b", named)]
    return (
        *map(StudyWarning, run.warnings),
        *([IdleContributors(tuple(idle))] if idle else []),
    )


def _unchanged(drawn: Drawn, name: str) -> bool:
    """Return whether all trials of a response are equal, its worst cases too.

    A response at zero or at an end of its range, as a share of time, may well stay
    there: then only if no deviation changes any response.
    """
    done, diagnostics = drawn.done(name), drawn.run.diagnostics
    if len(done) < 2 or done.min() < done.max():
        return False
    value = float(done[0])
    worst = [each.value for each in diagnostics.worst_cases.get(name, {}).values()]
    slopes = diagnostics.slopes.get(name, {})
    if any(slopes.values()) or any(each != value for each in worst):
        return False
    (response,) = (each for each in drawn.run.responses if each.name == name)
    at_an_end = value in (0.0, *(response.range or ()))
    return not at_an_end or {*slopes} <= {*diagnostics.idle}


def in_words(
    warnings: Iterable[ReportWarning], scales: Mapping[str, Scale]
) -> blocks.Bullets:
    """Return warnings as sentences, in front of all else."""
    return blocks.Bullets(tuple(_sentence(each, scales) for each in warnings))


def _sentence(warning: ReportWarning, scales: Mapping[str, Scale]) -> Parts:
    match warning:
        case StudyWarning(sentence):
            return text(sentence)
        case IdleContributors(names):
            return say(
                "No response depends on {}: its tolerance changes nothing. Check "
                "the name and the model."
                if len(names) == 1
                else "No response depends on {}: their tolerances change nothing. "
                "Check the names and the model.",
                listed([*map(Name, names)]),
            )
        case UnchangedResponse(name, value):
            return say(
                "No deviation changes {}: all trials have {}, and sigma is 0.",
                Name(name), Number(value, scales[name]),
            )  # fmt: skip
