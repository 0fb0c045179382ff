"""What a run says beyond its trials."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from tolstat.statistics.estimate import Estimate

Members = tuple[str, ...]  # contributors, taken together


class WorstCase(NamedTuple):
    """The worst corner of the tolerances that was found.

    Attributes
    ----------
    value : float
        Of the response, SI; NaN if every machine tried failed.
    deviations : dict of str to float
        The machine, SI.
    tried, failed : int
        Machines simulated for it, and how many of these failed.
    """

    value: float
    deviations: Mapping[str, float]
    tried: int
    failed: int


class Worst(NamedTuple):
    """One of the worst trials of a response.

    Attributes
    ----------
    trial : int
        Its number.
    precise : float
        The response, evaluated more precisely, SI; NaN where that failed or cannot be.
    """

    trial: int
    precise: float


class Halved(NamedTuple):
    """The fraction out of limit with some tolerances halved, from weighted trials.

    Attributes
    ----------
    beyond : Estimate
        The fraction, or why it cannot be estimated.
    effective : int
        Effective sample size; 0 without weights.
    """

    beyond: Estimate
    effective: int


@dataclass(frozen=True)
class Diagnostics:
    """What a run says beyond its trials.

    Attributes
    ----------
    slopes : dict of str to dict of str to float
        By response and contributor that deviates, at the nominal machine, SI.
    worst_cases : dict of str to dict of str to WorstCase
        By limited response and side: "least", "largest".
    worst : dict of str to list of Worst
        The worst ten trials of limited responses, the worst first.
    halved : dict of str to dict of Members to Halved
        By limited response and the contributors whose tolerances are halved, at once.
    missing : str
        Why there is none of it; empty if there is.
    """

    slopes: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    worst_cases: Mapping[str, Mapping[str, WorstCase]] = field(default_factory=dict)
    worst: Mapping[str, list[Worst]] = field(default_factory=dict)
    halved: Mapping[str, Mapping[Members, Halved]] = field(default_factory=dict)
    missing: str = ""
