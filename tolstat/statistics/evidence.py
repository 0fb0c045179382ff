"""What further simulations add to a run: data only, whoever made it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

from tolstat.machines.description import History


class Worst(NamedTuple):
    """One of the worst trials of a response.

    Attributes
    ----------
    trial : int
        Its number.
    value : float
        As stored, SI.
    precise : float
        Integrated again, more precisely; NaN where that failed.
    """

    trial: int
    value: float
    precise: float


class WorstCase(NamedTuple):
    """The worst corner of the tolerances that was found.

    Attributes
    ----------
    side : str
        "largest" or "least".
    value : float
        Of the response, SI; NaN if every machine tried failed.
    deviations : dict of str to float
        The machine, SI.
    tried, failed : int
        Machines simulated for it, and how many of these failed.
    """

    side: str
    value: float
    deviations: dict[str, float]
    tried: int
    failed: int


@dataclass(frozen=True)
class Evidence:
    """What further simulations say, by response.

    Attributes
    ----------
    slopes : dict of str to dict of str to float
        By response and contributor, at the nominal machine, SI.
    worst_cases : dict of str to list of WorstCase
        Of limited responses.
    worst : dict of str to list of Worst
        The worst ten trials of limited responses, the worst first.
    histories : dict of int to History
        Of these trials, where the machine moves.
    precise_rtol : float or None
        With which the worst trials were integrated again.
    missing : str
        Why there is none of it; empty if there is.
    """

    slopes: dict[str, dict[str, float]] = field(default_factory=dict)
    worst_cases: dict[str, list[WorstCase]] = field(default_factory=dict)
    worst: dict[str, list[Worst]] = field(default_factory=dict)
    histories: dict[int, History] = field(default_factory=dict)
    precise_rtol: float | None = None
    missing: str = ""
