"""What a run consists of: known before anything has run, and at its end."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.model.description import Description, StudyNumber
from tolstat.statistics.limits.limit import Limit
from tolstat.store.audited import Audited
from tolstat.store.stored_diagnostics import Evidence

Array = NDArray[np.float64]

SCORES = np.linspace(-8.0, 8.0, 513)  # normal scores; hardly a part lies beyond


class Assumed(NamedTuple):
    """What was assumed of a deviation.

    Attributes
    ----------
    tolerance : tuple of float
        Its ends, SI.
    words : str
        Its distribution.
    batch : str
        The batch whose parts are all as this one; empty for a part of its own.
    mean, sigma : float
        Of its distribution, SI; NaN in runs made before they were stored.
    at_scores : tuple of float
        Deviations at the normal scores of `SCORES`, SI, the least first: how far out a
        part lies. Of rare runs; empty in others, and in those made before.
    """

    tolerance: tuple[float, float]
    words: str
    batch: str
    mean: float = math.nan
    sigma: float = math.nan
    at_scores: tuple[float, ...] = ()


class Chosen(NamedTuple):
    """A setting: its value as written, what it is, and whether the study gave it."""

    words: str
    sentence: str
    given: bool


class Swept(NamedTuple):
    """A setting that is not the same in all trials."""

    values: NDArray[Any]  # float64[trial] or str[trial], SI, or words
    # SI unit, the unit in which it is written, and what it is
    unit: str
    shown: str
    sentence: str


class Sampled(NamedTuple):
    """How the machines were drawn.

    Attributes
    ----------
    seed : int
        From which all random numbers come.
    promise : str
        What may be said about intervals.
    replicates : int
        Independent randomisations; 0 where every trial is independent.
    group : int
        Trials that belong together.
    factors : tuple of str
        What varies independently, in the order in which it is drawn.
    """

    seed: int
    promise: str
    replicates: int
    group: int
    factors: tuple[str, ...]


class Reference(NamedTuple):
    """Known points of a publication or a measurement.

    Attributes
    ----------
    label : str
        Where they come from.
    columns : dict of str to float64[point]
        The swept contributor or setting first, then responses, SI.
    """

    label: str
    columns: Mapping[str, Array]


@dataclass(frozen=True, kw_only=True, repr=False)
class Known:
    """What a run says of itself from before its first trial on.

    Attributes
    ----------
    title, model, sampling : str
        Of the study.
    machine : str
        FILE.py:NAME of a machine of one's own; empty for an installed one.
    words : dict of int to str
        The word of each status that a trial can have.
    source_digest : str
        Of the source that decides the numbers.
    sampled : Sampled or None
        How the machines are drawn; None where they are chosen.
    settings : dict of str to Chosen
        Of the machine, all of them, as they are written.
    limits : dict of str to Limit
        By response, SI.
    assumed : dict of str to Assumed
        By contributor that deviates.
    grid : tuple of str
        What a grid sweeps, the slowest first; empty for any other run.
    reference : Reference or None
        Known points to be shown beside a grid.
    notes, assumptions : tuple of str
        What has to be known of the deviations, and of the machine's answers.
    numbers : tuple of StudyNumber
        Numbers of the study, shown beside those of its machines.
    rules : tuple of str
        The stopping rule, as it is written; empty without one.
    study_file : Path or None
        Where the study lies; None for one that is no file.
    rare : str
        The response whose limit a rare run is about; empty for any other run.
    """

    title: str
    model: str
    machine: str
    sampling: str
    words: dict[int, str]
    source_digest: str
    sampled: Sampled | None
    settings: dict[str, Chosen]
    limits: dict[str, Limit]
    assumed: dict[str, Assumed]
    grid: tuple[str, ...] = ()
    reference: Reference | None = None
    notes: tuple[str, ...] = ()
    assumptions: tuple[str, ...] = ()
    numbers: tuple[StudyNumber, ...] = ()
    rules: tuple[str, ...] = ()
    study_file: Path | None = None
    rare: str = ""


@dataclass(frozen=True, kw_only=True, repr=False)
class Plan(Known):
    """All that is known of a run before anything has run."""

    study_text: str  # the study as it was written
    description: Description  # contributors and responses, in the order of the columns
    deviations: Array  # float64[trial, contributor]: all of them, drawn
    integrates: bool  # whether trials count steps
    # the unit in which the study writes a contributor, response or swept setting
    shown: Mapping[str, str]
    # what a grid changes besides deviations
    swept: Mapping[str, Swept] = field(default_factory=dict)
    # mapping of str to float64[trial]: columns that say how trials were drawn, where
    # not all were drawn alike
    drawn: Mapping[str, Array] = field(default_factory=dict)


class Stopped(NamedTuple):
    """What a stopping rule made of a run.

    Attributes
    ----------
    rules : tuple of str
        As they are written: `Plan.rules`.
    reached : bool
        Whether all of them were.
    stages : tuple of int
        After how many trials they were looked at.
    at_most : int
        Trials after which it would have ended whatever was reached.
    wanted : float
        Trials that the last look asked for: 0 if all was reached, infinite where there
        was no interval yet.
    """

    rules: tuple[str, ...]
    reached: bool
    stages: tuple[int, ...]
    at_most: int
    wanted: float = 0.0


class Ending(NamedTuple):
    """What is known of a run at its end."""

    trials: int  # how many of the planned ones are kept; all of these have run
    stopped: Stopped | None  # None without a stopping rule
    # None for a machine that cannot be evaluated more precisely
    audited: Audited | None
    evidence: Evidence  # what further simulations say
    # failed trials evaluated again; None where nobody asked for that
    rerun: Audited | None = None
