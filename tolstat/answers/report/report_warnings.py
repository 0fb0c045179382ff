"""Warnings of a report: what a reader has to know before any verdict."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import NamedTuple

from tolstat.answers.sampled_trials import Drawn
from tolstat.document import blocks
from tolstat.document.inline import Name, Number, Parts, counted, listed, say, text
from tolstat.statistics.clusters import Clusters
from tolstat.statistics.estimate import Estimate
from tolstat.statistics.limits.audited_response import Movement
from tolstat.store.stored_run import Run
from tolstat.units.scale import Scale

JUMPS = "the response jumps"  # why there is neither cause nor advice
TURNS = {0.5: "half a", 1.0: "a whole"}
# an angle never jumps by a turn, while a machine with play or a stop may well jump
MEND_TURN = ", so no tolerance explains it. Mend the formula of the response"
MEND_STEP = ". If the machine does not jump so, mend the formula of the response"


class StudyWarning(NamedTuple):
    """A warning of the study or of its model, known before any trial ran."""

    sentence: str
    kind: str = "study"


class JumpWarning(NamedTuple):
    """A response whose trials fall into two clusters a step apart."""

    response: str
    clusters: Clusters
    scale: Scale
    kind: str = "jump"


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


class IdleContributors(NamedTuple):
    """Contributors that deviate and change no response."""

    contributors: tuple[str, ...]
    kind: str = "idle contributors"


class UnchangedResponse(NamedTuple):
    """A limited response that no deviation changes."""

    response: str
    value: float  # of all its trials, SI
    scale: Scale
    kind: str = "unchanged response"


ReportWarning = (
    StudyWarning
    | IdleContributors
    | UnchangedResponse
    | JumpWarning
    | VerdictWarning
    | NumbersWarning
)


def warnings_of(
    drawn: Drawn, clusters: Mapping[str, Clusters], *, unsettled: bool = False
) -> tuple[ReportWarning, ...]:
    """Return the warnings about a run whose trials were sampled.

    `clusters` are those of `jumping`. Where integration errors leave a verdict
    `unsettled`, they may as well be why a contributor changes nothing.
    """
    run = drawn.run
    if unsettled:
        return tuple(map(StudyWarning, run.warnings))
    return (
        *warnings_of_run(run),
        *(
            UnchangedResponse(name, float(drawn.done(name)[0]), run.scales[name])
            for name in run.limits
            if _unchanged(drawn, name)
        ),
        *jump_warnings(run, clusters),
    )


def jump_warnings(
    run: Run, clusters: Mapping[str, Clusters]
) -> tuple[JumpWarning, ...]:
    """Return the warnings about responses that jump, of `jumping`."""
    return tuple(JumpWarning(name, x, run.scales[name]) for name, x in clusters.items())


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


def in_words(warnings: Iterable[ReportWarning]) -> blocks.Bullets:
    """Return warnings as a list, in front of all else."""
    return blocks.Bullets(tuple(text("Warning: ", s) for s in sentences(warnings)))


def sentences(warnings: Iterable[ReportWarning]) -> tuple[Parts, ...]:
    """Return warnings as sentences."""
    return tuple(map(_sentence, warnings))


def _sentence(warning: ReportWarning) -> Parts:
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
        case UnchangedResponse(name, value, scale):
            return say(
                "No deviation changes {}: all trials have {}, and sigma is 0.",
                Name(name), Number(value, scale),
            )  # fmt: skip
        case JumpWarning():
            return _jump(warning)
        case VerdictWarning():
            return _verdict(warning)
        case NumbersWarning():
            return _numbers(warning)


def _jump(warning: JumpWarning) -> Parts:
    found, scale = warning.clusters, warning.scale
    step = f" {TURNS[found.turn]} turn," if found.turn else ""
    mend = MEND_TURN if found.turn else MEND_STEP
    return say(
        f"{{}} jumps by{step} {{}}: {{}} lie at {{}} or below, {{}} at {{}} or above. "
        f"Parts that are nearly equal lie on both sides{mend}, then run the study "
        "again.",
        Name(warning.response), Number(found.step, scale),
        counted(found.below, "trial"), Number(found.lower, scale),
        Number(found.above), Number(found.upper, scale),
    )  # fmt: skip


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
