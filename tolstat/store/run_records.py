"""Records that a run is made of."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

SCORES = np.linspace(-8.0, 8.0, 513)  # normal scores; hardly a part lies beyond


@dataclass(frozen=True)
class StudyText:
    """The study that a run was made from: its text, as it was written."""

    text: str

    @cached_property
    def table(self) -> dict[str, Any]:
        """The text, read as TOML."""
        return tomllib.loads(self.text)

    @property
    def trials(self) -> int | None:
        """How many it asks for; None where it has a stopping rule, or none."""
        trials = self.table.get("trials")
        return trials if isinstance(trials, int) else None

    @property
    def seed(self) -> int | None:
        """Its seed; None where it has none."""
        return self.table.get("seed")


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
        Of its distribution, SI.
    at_scores : tuple of float
        Deviations at the normal scores of `SCORES`, SI, the least first: how far out a
        part lies. Of rare runs; empty in others.
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
    """A setting that a grid changes; fields as of `Contributor`."""

    name: str
    unit: str
    sentence: str
    shown: str


class DrawDetail(NamedTuple):
    """A column that says how each trial was drawn; fields as of `Contributor`."""

    name: str
    unit: str
    sentence: str


class Sampled(NamedTuple):
    """How the machines were drawn: what their sampler says of it.

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
    sample : bool
        Whether the trials are a sample of production.
    aim : str
        The response whose limit was sought; empty where none was.
    """

    seed: int
    promise: str
    replicates: int
    group: int
    factors: tuple[str, ...]
    sample: bool
    aim: str


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
    columns: Mapping[str, NDArray[np.float64]]


class Stopped(NamedTuple):
    """What a stopping rule made of a run.

    Attributes
    ----------
    rules : tuple of str
        As they are written: `Run.rules`.
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
