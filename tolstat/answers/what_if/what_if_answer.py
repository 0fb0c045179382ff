"""The answers of a run if its parts came from other distributions, and their page."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

from tolstat.answers.report.findings import JointFindings
from tolstat.answers.report.template_page import page_of
from tolstat.render.plain import share_words
from tolstat.statistics.summary import QUANTILES, Summary
from tolstat.units.scale import Scale


class Changed(NamedTuple):
    """How a deviation is distributed, in words, and what that alone leaves.

    Attributes
    ----------
    as_run, what_if : str
        As the run has it, and as is asked.
    worth : float
        Effective trials for each with this change alone.
    """

    as_run: str
    what_if: str
    worth: float


class Asked(NamedTuple):
    """What is asked, and what the stored trials are worth for it.

    Attributes
    ----------
    deviations : dict of str to Changed
        By contributor that changes; all others are as the run has them, and so are
        batches and correlations.
    trials, effective : int
        Trials that are weighted, and how many independent ones they are worth.
    expected : float
        That number as the distributions have it, without the trials.
    """

    deviations: Mapping[str, Changed]
    trials: int
    effective: int
    expected: float


@dataclass(frozen=True)
class Weighed(Summary):
    """A response with what is asked, and beside it as the run has it.

    Attributes
    ----------
    nominal : float
        Of the nominal machine, SI.
    sentence : str
        What it is.
    scale : Scale
        How it is shown.
    as_run : Summary
        Without what is asked.
    """

    nominal: float
    sentence: str
    scale: Scale
    as_run: Summary


@dataclass(frozen=True)
class WhatIf:
    """The answers of a run if its parts came from other distributions; SI.

    Attributes
    ----------
    title, run, model : str
        Of the run.
    what_if : Asked
        What is asked.
    joint, joint_as_run : JointFindings or None
        All limits together; None without any.
    responses : dict of str to Weighed
        All of them.
    notes : tuple of str
        What must be known to read the numbers.
    """

    title: str
    run: str
    model: str
    what_if: Asked
    joint: JointFindings | None
    joint_as_run: JointFindings | None
    responses: Mapping[str, Weighed]
    notes: tuple[str, ...]


def make_what_if_page(found: WhatIf) -> str:
    """Make the page of what is asked: HTML, every number on it one of the answers."""
    return page_of(
        "what_if.html",
        found,
        title=f"{found.title}: what if",
        limited=[name for name, each in found.responses.items() if each.limited],
        shares=QUANTILES,
        share_words=share_words,
    )
