"""Declarations of a motion: its states, its parts, its responses."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NoReturn

from tolstat.errors import ModelError, allowed_names


@dataclass(frozen=True)
class State:
    """What changes over time; `motion` returns its rate.

    Attributes
    ----------
    unit : str
        SI.
    start : float or callable
        At the start: a number, or a function of the parts, as lambda p: p.length.
    size : float, optional
        To which errors are related; without it the largest of the nominal trial. It
        is less where a response depends sharply on the state, as the force of a stop.
    sentence : str
        A few words of description.
    """

    unit: str
    start: float | Callable[[Any], Any] = 0.0
    size: float | None = None
    sentence: str = ""


@dataclass(frozen=True)
class Part:
    """A dimension or property of the parts; a study gives its deviation.

    Attributes
    ----------
    nominal : float
        SI.
    unit : str
        SI, "1" for a plain number.
    sentence, shown : str
        A few words of description; the unit in which it is shown.
    """

    nominal: float
    unit: str
    sentence: str = ""
    shown: str = ""


@dataclass(frozen=True)
class Response:
    """What a trial yields, of a quantity that `motion` returns under the same name.

    Attributes
    ----------
    kind : str
        One of KINDS, what is taken of the quantity over time.
    unit : str
        SI, of the response.
    sentence, shown : str
        A few words of description; the unit in which it is shown.
    """

    kind: str
    unit: str
    sentence: str = ""
    shown: str = ""

    @classmethod
    def peak(cls, unit: str, sentence: str = "", shown: str = "") -> Response:
        """Return the largest size of a quantity, of either sign."""
        return cls("peak", unit, sentence, shown)

    @classmethod
    def greatest(cls, unit: str, sentence: str = "", shown: str = "") -> Response:
        """Return the greatest value of a quantity."""
        return cls("greatest", unit, sentence, shown)

    @classmethod
    def least(cls, unit: str, sentence: str = "", shown: str = "") -> Response:
        """Return the least value of a quantity."""
        return cls("least", unit, sentence, shown)

    @classmethod
    def integral(cls, unit: str, sentence: str = "", shown: str = "") -> Response:
        """Return the integral of a quantity over time."""
        return cls("integral", unit, sentence, shown)

    @classmethod
    def above(cls, unit: str, sentence: str = "", shown: str = "") -> Response:
        """Return the time during which a quantity is above zero."""
        return cls("above", unit, sentence, shown)

    @classmethod
    def end(cls, unit: str, sentence: str = "", shown: str = "") -> Response:
        """Return a quantity at the end."""
        return cls("end", unit, sentence, shown)


class Letters:
    """Values by name, as y.x; an unknown name is a sentence."""

    def __init__(self, kind: str, values: Mapping[str, Any]) -> None:
        """Take the values of a kind, "state" or "part"."""
        self.__dict__ |= values
        self._kind = kind

    def __getattr__(self, name: str) -> NoReturn:
        if name.startswith("__"):  # asked by Python, as by copy
            raise AttributeError(name)
        allowed = [key for key in self.__dict__ if key != "_kind"]
        raise ModelError(
            f"no {self._kind} is called {name}; {allowed_names(name, allowed)}"
        )
