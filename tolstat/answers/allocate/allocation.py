"""What came of an allocation: tolerances, what they cost, and what that buys."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from tolstat.answers.allocate.optimizer import Choice
from tolstat.model.view import Axis, Chart, Curve, Mark, Panel
from tolstat.statistics.estimate import Estimate

BEYOND = Axis("machines beyond any limit", "1", "ppm", logarithmic=True)
BELOW = 0.1  # of the least share that is shown: lower ends of intervals are seen so far


class Scheme(NamedTuple):
    """Tolerances, what they cost, and how many machines they put beyond the limits.

    Attributes
    ----------
    cost : float
        Of all parts whose cost is stated.
    tolerances : dict of str to str
        By line of the study, as written.
    halves : dict of str to float
        Half their widths, SI.
    beyond : dict of str to Estimate
        Share of the machines beyond each limit.
    beyond_any : Estimate
        Share of those beyond one limit or several.
    trials, seed : int
        Of the fresh run that showed this.
    """

    cost: float
    tolerances: dict[str, str]
    halves: dict[str, float]
    beyond: dict[str, Estimate]
    beyond_any: Estimate
    trials: int
    seed: int


class Line(NamedTuple):
    """One line of the study, allocated.

    Attributes
    ----------
    name, parts : str, int
        And how many parts share its tolerance.
    drawn, found : str
        The tolerances.
    cost_drawn, cost : float
        Of all its parts.
    at_loosest, free : bool
        Whether it is as loose as it may be, and whether its width, between its
        loosest and its tightest, is shown to put no more machines beyond any limit
        than a fiftieth of what that permits.
    """

    name: str
    parts: int
    drawn: str
    found: str
    cost_drawn: float
    cost: float
    at_loosest: bool
    free: bool


class Allocation(NamedTuple):
    """What came of an allocation.

    Attributes
    ----------
    met : bool
        Whether a fresh run showed that the tolerances meet every limit.
    cost : float
        Of them.
    tolerances : dict of str to float
        Half widths by line of the study, SI; where no allocation meets the limits,
        those of the tightest one.
    lines : tuple of Line
        The same, beside those drawn.
    schemes : dict of str to Scheme
        "as drawn", "found" or "tightest", "at the cost drawn" where one was found,
        "root sum square", "worst case" where there are slopes, and tolerances that do;
        all by runs of one seed, by which nothing was chosen, but the tightest.
    proof : Scheme
        The answer, by the fresh run that its verdicts are of.
    again : bool
        Whether a run of the file with the proof's trials and seed has its machines.
    verdicts : dict of str to str
        Of each limit, by that run.
    active : tuple of str
        Limits that a step looser of any tolerance would break: a tenth, as far as it
        may be looser, or the next one offered.
    notes : tuple of str
        How it was found, what was tried in vain.
    wide_run : int
        Machines that were drawn to be weighted: of the wide run, and of those about
        what was scaled.
    fresh_runs : tuple of int
        Machines of each fresh run, in the order in which they were made.
    curve : Chart
        Cost over the share of machines beyond.
    text : str
        The study with these tolerances, as a file.
    """

    met: bool
    cost: float
    tolerances: dict[str, float]
    lines: tuple[Line, ...]
    schemes: dict[str, Scheme]
    proof: Scheme
    again: bool
    verdicts: dict[str, str]
    active: tuple[str, ...]
    notes: tuple[str, ...]
    wide_run: int
    fresh_runs: tuple[int, ...]
    curve: Chart
    text: str


class Point(NamedTuple):
    """The cheapest tolerances for some share of the machines beyond any limit."""

    cost: float  # of the tolerances
    beyond: float  # that share, which weighted machines exceed as likely as not
    choice: Choice  # the tolerances, one of each line that has a cost


def trade_off(
    points: list[Point], schemes: Mapping[str, Scheme], *, listed: bool = False
) -> Chart:
    """Draw the cost of the cheapest tolerances over the machines beyond.

    Parameters
    ----------
    points : list of Point
        Of the cheapest: a curve.
    schemes : mapping of str to Scheme
        Tolerances beside it: dots with their intervals. What is the same for several
        is drawn once, by the longest run of it.
    listed : bool
        Whether every tolerance is one of a list: nothing lies between the points then.
    """
    ordered = sorted(points, key=lambda each: each.beyond)
    at = np.array([each.beyond for each in ordered])
    costs = np.array([each.cost for each in ordered])
    words = "cost of the cheapest tolerances"
    curves, marks = [Curve("cheapest", "1", "", words, costs, points=listed)], []
    alike: dict[tuple[str, ...], list[str]] = {}
    for name, scheme in schemes.items():
        alike.setdefault(tuple(scheme.tolerances.values()), []).append(name)
    for names in alike.values():
        scheme = max((schemes[name] for name in names), key=lambda each: each.trials)
        words, (share, lower, upper, _) = " = ".join(names), scheme.beyond_any
        if share > 0:
            ends = np.array([lower, share, upper])
            marks.append(Mark(words, share, scheme.cost))
        else:  # has no place on an axis of ratios
            words += f", {scheme.cost:.4g}: none of {scheme.trials} beyond"
            ends = np.array([lower, upper])
        values = np.full(len(ends), scheme.cost)
        curves.append(Curve(words, "1", "", "tolerances beside it", values, ends))
    # an interval that reaches far below all else leaves no room for that
    uppers = [each.beyond_any.upper for each in schemes.values()]
    seen = [*at.tolist(), *(mark.at for mark in marks), *uppers]
    axis = BEYOND._replace(least=BELOW * min(seen))
    panel = Panel("cost", tuple(each.name for each in curves))
    return Chart(axis, at, tuple(curves), marks=tuple(marks), panels=(panel,))
