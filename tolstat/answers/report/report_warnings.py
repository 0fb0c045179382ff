"""Warnings of a report: what a reader has to know before any verdict."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np

from tolstat.answers.sampled_trials import Drawn
from tolstat.arrays import Array, Integers
from tolstat.document import blocks
from tolstat.document.inline import Name, Number, Parts, counted, say, text
from tolstat.statistics.clusters import Clusters, clusters_of
from tolstat.units.scale import Scale

# by SI unit of a response: its whole turns, and the fewest trials a turn away that are
# named; a plain number may be an angle
TURNS = {"rad": ((2 * math.pi,), 1), "1": ((2 * math.pi, 360.0), 5)}
JUMPS = "the response jumps"  # why there is neither cause nor advice


class StudyWarning(NamedTuple):
    """A warning of the study or of its model, known before any trial ran."""

    sentence: str
    kind: str = "study"


class JumpWarning(NamedTuple):
    """A response whose trials fall into two clusters that no tolerance explains."""

    response: str
    clusters: Clusters
    scale: Scale
    kind: str = "jump"


ReportWarning = StudyWarning | JumpWarning


def warnings_of(
    drawn: Drawn, clusters: Mapping[str, Clusters]
) -> tuple[ReportWarning, ...]:
    """Return the warnings about a run whose trials were sampled.

    `clusters` are those of `jumping`.
    """
    run = drawn.run
    jumps = (JumpWarning(name, x, run.scales[name]) for name, x in clusters.items())
    return (*map(StudyWarning, run.warnings), *jumps)


def jumping(drawn: Drawn, responses: Iterable[str]) -> dict[str, Clusters]:
    """Return the clusters of responses that jump, by response."""
    done, units = np.flatnonzero(drawn.sample.done), drawn.run.units
    names = list(drawn.run.assumed)

    def rows(trials: Integers) -> Array:
        parts = [drawn.values(name)[done[trials]] for name in names]
        return np.stack(parts, axis=1) if parts else np.empty((len(trials), 0))

    every = {
        n: clusters_of(drawn.done(n), rows, *TURNS.get(units[n], ())) for n in responses
    }
    return {name: clusters for name, clusters in every.items() if clusters}


def in_words(warnings: Iterable[ReportWarning]) -> blocks.Bullets:
    """Return warnings as sentences, in front of all else."""
    return blocks.Bullets(tuple(map(_sentence, warnings)))


def _sentence(warning: ReportWarning) -> Parts:
    if isinstance(warning, StudyWarning):
        return text(warning.sentence)
    found, scale = warning.clusters, warning.scale
    step = " a whole turn," if found.turn else ""
    return say(
        f"{{}} jumps by{step} {{}}: {{}} lie at {{}} or below, {{}} at {{}} or above. "
        "Parts that are nearly equal lie on both sides, so no tolerance explains it. "
        "Mend the formula of the response, then run the study again.",
        Name(warning.response), Number(found.step, scale),
        counted(found.below, "trial"), Number(found.lower, scale),
        Number(found.above), Number(found.upper, scale),
    )  # fmt: skip
