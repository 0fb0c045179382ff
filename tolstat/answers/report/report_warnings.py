"""Warnings of a report: what a reader has to know before any verdict."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import NamedTuple

from tolstat.answers.sampled_trials import Drawn
from tolstat.document import blocks
from tolstat.document.inline import Name, Number, Parts, say, text
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.limits.audited_response import Movement
from tolstat.units.scale import Scale


class StudyWarning(NamedTuple):
    """A warning of the study or of its model, known before any trial ran."""

    sentence: str
    kind: str = "study"


class VerdictWarning(NamedTuple):
    """A verdict that integration errors leave undecided."""

    response: str
    movement: Movement
    scale: Scale
    kind: str = "verdict"


class WrongNumber(NamedTuple):
    """A number that errs by more than its interval."""

    number: Estimate
    error: float  # by the trials evaluated again: the number less its right value


class NumbersWarning(NamedTuple):
    """Numbers of a response whose integration errors exceed their intervals."""

    response: str
    numbers: Mapping[str, WrongNumber]
    scale: Scale
    kind: str = "numbers"


ReportWarning = StudyWarning | VerdictWarning | NumbersWarning


def warnings_of(drawn: Drawn) -> tuple[ReportWarning, ...]:
    """Return the warnings about a run whose trials were sampled."""
    return tuple(map(StudyWarning, drawn.run.warnings))


def in_words(warnings: Iterable[ReportWarning]) -> blocks.Bullets:
    """Return warnings as sentences, in front of all else."""
    return blocks.Bullets(tuple(map(_sentence, warnings)))


def _sentence(warning: ReportWarning) -> Parts:
    if isinstance(warning, VerdictWarning):
        return _verdict(warning)
    if isinstance(warning, NumbersWarning):
        return _numbers(warning)
    return text(warning.sentence)


def _verdict(warning: VerdictWarning) -> Parts:
    seen = movement_words(warning.movement, warning.scale)
    return say("{}: undecided (integration error: {})", Name(warning.response), seen)


def movement_words(seen: Movement, scale: Scale) -> Parts:
    """Say how many trials moved when they were evaluated again, and how far."""
    exact = scale._replace(least=0.0)
    largest = Number(seen.largest, exact)
    said = say("errors of up to {} may change the verdict", largest)
    if seen.moved:
        moved = f"{seen.moved} of {seen.trials} trials evaluated again moved, by up to "
        said = text(moved, largest)
    third = f"; evaluated a third time, {seen.moved_third} of {seen.third} moved"
    return text(said, third if seen.moved_third else None)


def _numbers(warning: NumbersWarning) -> Parts:
    exact = warning.scale._replace(least=0.0)
    (name, wrong), *others = warning.numbers.items()
    more = f", and {len(others)} more" if others else None
    return say(f"{{}}: {name} {{}}, integration error {{}}{{}}",
               Name(warning.response), Number(wrong.number, exact),
               Number(wrong.error, exact), more)  # fmt: skip
