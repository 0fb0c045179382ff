"""Warnings of a report: what a reader has to know before any verdict."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from tolstat.answers.sampled_trials import Drawn
from tolstat.document import blocks
from tolstat.document.inline import Parts, text


class StudyWarning(NamedTuple):
    """A warning of the study or of its model, known before any trial ran."""

    sentence: str
    kind: str = "study"


ReportWarning = StudyWarning


def warnings_of(drawn: Drawn) -> tuple[ReportWarning, ...]:
    """Return the warnings about a run whose trials were sampled."""
    return tuple(map(StudyWarning, drawn.run.warnings))


def in_words(warnings: Iterable[ReportWarning]) -> blocks.Bullets:
    """Return warnings as sentences, in front of all else."""
    return blocks.Bullets(tuple(map(_sentence, warnings)))


def _sentence(warning: ReportWarning) -> Parts:
    return text(warning.sentence)
