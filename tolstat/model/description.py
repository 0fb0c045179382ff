"""Contributors and responses, as a model declares them."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from tolstat.deviations.names import general

# ranges of responses
POSITIVE = (0.0, math.inf)
SHARE = (0.0, 1.0)


class Gear(NamedTuple):
    """The wheel whose ISO 1328 class a deviation follows."""

    diameter: float  # of reference, m
    error: str  # "run-out" (amplitude) or "pitch" (position of a tooth)


@dataclass(frozen=True)
class Contributor:
    """A dimension or property that carries a tolerance."""

    name: str  # as typed in study files; NAME stands for every `NAME_<number>`
    unit: str  # SI, of its deviation; "1" for a deviation relative to the nominal
    symbol: str = ""  # the paper's letter
    sentence: str = ""  # a few words of description
    source: str = ""  # where it enters the equations
    # nominal value, in that unit: per cent, sizes and ISO 286 grades refer to it
    size: float | None = None
    gear: Gear | None = None  # the wheel that an ISO 1328 class refers to
    # kind of part that it belongs to, such as "gears": contributions are summed over
    # it; else over contributors whose names differ in their number alone
    part: str = ""
    # unit in which it is shown where a study types none; by its size if empty. "1" is a
    # plain number, "count" a whole one
    shown: str = ""


@dataclass(frozen=True)
class Response:
    """A number that a trial yields; see `Contributor`."""

    name: str
    unit: str
    symbol: str = ""
    sentence: str = ""
    source: str = ""
    shown: str = ""
    # bounds, SI, by definition: a share lies between 0 and 1. An open end is
    # infinite. Intervals of its mean use them
    range: tuple[float, float] | None = None
    # whether it is zero but for the integration error, as the rest of a balance of
    # energy: then it says how large that is, and has none beside itself
    residual: bool = False


class StudyNumber(NamedTuple):
    """A number of the study: the same for all its trials, and shown beside them.

    Name, unit, sentence and `shown` are those of `Contributor`.
    """

    name: str
    unit: str
    value: float  # SI; NaN where there is none
    sentence: str = ""
    shown: str = ""
    of: str = ""  # the response that it describes, with the same unit
    caveat: str = ""  # its limits, or why there is no value
    # "least" or "largest" if it is the worst case of `of` on that side
    worst: str = ""


class Description(NamedTuple):
    """The contributors and responses of a model with given settings, in order."""

    contributors: tuple[Contributor, ...]
    responses: tuple[Response, ...]


def kinds_of_part(
    names: Sequence[str], contributors: Iterable[Contributor]
) -> dict[str, list[str]]:
    """Return contributors by the kind of part, else by their name without number.

    `names` are those that deviate; a kind has two of them or more.
    """
    parts = {contributor.name: contributor.part for contributor in contributors}
    kinds: dict[str, list[str]] = {}
    for name in names:
        kinds.setdefault(parts[name] or general(name), []).append(name)
    return {kind: members for kind, members in kinds.items() if len(members) > 1}
