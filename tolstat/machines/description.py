"""What a model says of itself: contributors, responses, settings."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray


class Gear(NamedTuple):
    """The wheel whose ISO 1328 class a deviation follows.

    Attributes
    ----------
    diameter : float
        Reference diameter, m.
    error : str
        "run-out" (amplitude) or "pitch" (position of a tooth).
    """

    diameter: float
    error: str


@dataclass(frozen=True)
class Contributor:
    """A dimension or property that carries a tolerance.

    Attributes
    ----------
    name : str
        As typed in study files; `NAME_<number>` also answers to NAME.
    unit : str
        SI unit of its deviation; "1" for a deviation relative to the nominal.
    symbol : str
        The paper's letter.
    sentence : str
        What it is.
    source : str
        Where it enters the equations.
    size : float, optional
        Nominal size, m, that an ISO 286 grade of this length refers to.
    gear : Gear, optional
        The wheel that an ISO 1328 class refers to.
    part : str
        Kind of part that it belongs to, such as "gears": contributions are summed over
        it; else over contributors whose names differ in their number alone.
    """

    name: str
    unit: str
    symbol: str
    sentence: str
    source: str
    size: float | None = None
    gear: Gear | None = None
    part: str = ""


@dataclass(frozen=True)
class Response:
    """A number that a trial yields; attributes as of `Contributor`."""

    name: str
    unit: str
    symbol: str
    sentence: str
    source: str


class Description(NamedTuple):
    """The contributors and responses of a model at given settings, in order."""

    contributors: tuple[Contributor, ...]
    responses: tuple[Response, ...]


class Outcome(NamedTuple):
    """What a block of trials yields.

    Attributes
    ----------
    responses : float64[trial, response]
        SI; NaN in failed trials.
    status : int64[trial]
        Values of `tolstat.status.Status`.
    steps : int64[trial] or None
        Integration steps; None where nothing is integrated.
    """

    responses: NDArray[np.float64]
    status: NDArray[np.int64]
    steps: NDArray[np.int64] | None = None


class Curve(NamedTuple):
    """One quantity over time.

    Attributes
    ----------
    name, unit, symbol, sentence : str
        As of a response; where a response has the same name, its peak is the curve's.
    values : float64[time]
        SI.
    """

    name: str
    unit: str
    symbol: str
    sentence: str
    values: NDArray[np.float64]


class Peak(NamedTuple):
    """Where a response that is a peak falls on its curve: time (s) and value (SI)."""

    curve: str
    time: float
    value: float


class Panel(NamedTuple):
    """Curves to be drawn in one picture.

    Attributes
    ----------
    title : str
        What they show.
    curves : tuple of str
        Of one unit.
    right : tuple of str
        Further curves of another unit, against an axis on the right.
    levels : tuple of (float, str)
        Values (SI) to be marked, each with its words.
    """

    title: str
    curves: tuple[str, ...]
    right: tuple[str, ...] = ()
    levels: tuple[tuple[float, str], ...] = ()


@dataclass(frozen=True)
class History:
    """How one machine moved.

    Attributes
    ----------
    time : float64[time]
        s.
    curves : tuple of Curve
        What happened; NaN after a failure.
    peaks : tuple of Peak
        Where the peaks fall, to within a sample.
    window : tuple of float
        Start and end of the time over which responses are taken, s.
    panels : tuple of Panel
        How to draw it.
    outcome : Outcome
        The same trial's responses, bit for bit as `evaluate` finds them.
    """

    time: NDArray[np.float64]
    curves: tuple[Curve, ...]
    peaks: tuple[Peak, ...]
    window: tuple[float, float]
    panels: tuple[Panel, ...]
    outcome: Outcome


class Model(Protocol):
    """A machine: what it may be given and what it answers.

    Attributes
    ----------
    name, title : str
        How it is called in study files, and in words.
    settings : type
        A frozen dataclass whose fields are declared with `setting`.

    Notes
    -----
    A model may say what its answers rest on, `assumptions`: sentences for reports.
    """

    name: str
    title: str
    settings: type

    def describe(self, settings: Any) -> Description:
        """List contributors and responses, which may depend on the settings."""
        ...

    def evaluate(self, deviations: NDArray[np.float64], settings: Any) -> Outcome:
        """Simulate one trial for each row of deviations[trial, contributor], SI."""
        ...


@runtime_checkable
class MovingModel(Model, Protocol):
    """A machine that moves, and can show how."""

    def history(
        self, deviations: NDArray[np.float64], settings: Any, step: float
    ) -> History:
        """Simulate the machine of deviations[contributor], SI, seen every `step` s."""
        ...


def setting(
    default: Any,
    sentence: str,
    *,
    unit: str = "",
    above: float | None = None,
    at_least: float | None = None,
    choices: Sequence[str] = (),
    presets: dict[str, float | None] | None = None,
) -> Any:
    """Declare one setting of a model, as a field of its settings dataclass.

    Parameters
    ----------
    default
        Its value when the study says nothing; its type decides what may be given.
    sentence : str
        What it is.
    unit : str
        SI unit of a number that has one.
    above, at_least : float, optional
        Lower bounds, the first excluded.
    choices : sequence of str
        The words allowed, for a setting that is a word.
    presets : dict, optional
        Words that stand for a value.
    """
    metadata = {
        "sentence": sentence,
        "unit": unit,
        "above": above,
        "at_least": at_least,
        "choices": tuple(choices),
        "presets": presets or {},
    }
    return dataclasses.field(default=default, metadata=metadata)
