"""What a looser tolerance would do: break a limit, or cost no yield at all."""

from __future__ import annotations

import math

import numpy as np

from tolstat.deviations.prices import Priced
from tolstat.execution.allocation import Line
from tolstat.execution.searching import Searching
from tolstat.statistics.cheapest import Choice
from tolstat.study.prices import tolerance_words

FREE = 0.02  # of the share that a limit permits: as good as nothing
AT_END = 1e-6  # of a tolerance
LOOSER = 0.1  # of a tolerance: a step that shows which limit binds


def lines_of(search: Searching, choice: Choice) -> tuple[Line, ...]:
    """Describe each line of the study, allocated.

    Parameters
    ----------
    search : Searching
        Whose weighted machines tell.
    choice : tuple of float
        As it is written.
    """
    return tuple(
        Line(
            each.name, len(each.drawn), tolerance_words(each, drawn),
            tolerance_words(each, x), each.cost(drawn), each.cost(x),
            at_loosest(each, x), costs_no_yield(search, choice, i),
        )
        for i, (each, drawn, x) in enumerate(
            zip(search.priced, search.drawn, choice, strict=True)
        )
    )  # fmt: skip


def active(search: Searching, choice: Choice) -> tuple[str, ...]:
    """Name the limits that a step looser of some tolerance would break.

    Parameters
    ----------
    search, choice
        As of `lines_of`.
    """
    broken = np.zeros(len(search.permitted), np.bool_)
    excess = search.above(search.permitted)
    for i, (each, x) in enumerate(zip(search.priced, choice, strict=True)):
        if not at_loosest(each, x):
            broken |= excess(_with(choice, i, _looser(each, x))) > 0
    names = list(search.runs.study.limits)
    return tuple(n for n, own in zip(names, broken.tolist(), strict=True) if own)


def at_loosest(priced: Priced, choice: float) -> bool:
    """Tell whether a tolerance is as loose as it may be."""
    return abs(choice - priced.ends[1]) < AT_END


def costs_no_yield(search: Searching, choice: Choice, line: int) -> bool:
    """Tell whether the width of a tolerance, as far as it goes, costs no yield."""
    tightest, loosest = (
        search.pool.about(_with(choice, line, end))[:-1]
        for end in search.priced[line].ends
    )
    return bool(np.all(loosest - tightest <= FREE * search.permitted))


def _looser(priced: Priced, choice: float) -> float:
    """Return a choice a step looser: a tenth at most, or the next one offered."""
    if not priced.law:
        return choice - 1
    return min(choice + math.log(1 + LOOSER), priced.ends[1])


def _with(choice: Choice, line: int, chosen: float) -> Choice:
    return (*choice[:line], chosen, *choice[line + 1 :])
