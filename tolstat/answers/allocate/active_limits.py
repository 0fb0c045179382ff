"""What a looser tolerance would do: break a limit, or cost no yield at all."""

from __future__ import annotations

import math

import numpy as np

from tolstat.answers.allocate.allocation import Line
from tolstat.answers.allocate.fresh_runs import Proof
from tolstat.answers.allocate.optimizer import Choice
from tolstat.answers.allocate.search import Searching
from tolstat.deviations.prices import Priced
from tolstat.statistics.intervals.proportions import proportion
from tolstat.study.cost_entry import tolerance_words

FREE = 0.02  # of the share that a limit permits: as good as nothing
CLEAR = 2.0  # times its standard error: a difference that weighted machines show
AT_END = 1e-6  # of a tolerance
LOOSER = 0.1  # of a tolerance: a step that shows which limit binds


def lines_of(search: Searching, proof: Proof) -> tuple[Line, ...]:
    """Describe each line of the study, allocated.

    Parameters
    ----------
    search : Searching
        Whose weighted machines tell.
    proof : Proof
        The answer, by its fresh run.
    """
    return tuple(
        Line(
            each.name, len(each.drawn), tolerance_words(each, drawn),
            tolerance_words(each, x), each.cost(drawn), each.cost(x),
            at_loosest(search, i, x), costs_no_yield(search, proof, i),
        )
        for i, (each, drawn, x) in enumerate(
            zip(search.priced, search.drawn, proof.choice, strict=True)
        )
    )  # fmt: skip


def active(search: Searching, choice: Choice) -> tuple[str, ...]:
    """Name the limits that a step looser of some tolerance would break.

    Parameters
    ----------
    search : Searching
        Whose weighted machines tell.
    choice : tuple of float
        As it is written.
    """
    broken = np.zeros(len(search.permitted), np.bool_)
    excess = search.above(search.permitted)
    for i, (each, x) in enumerate(zip(search.priced, choice, strict=True)):
        if not at_loosest(search, i, x):
            broken |= excess(_with(choice, i, _looser(each, x))) > 0
    names = list(search.runs.study.limits)
    return tuple(n for n, own in zip(names, broken.tolist(), strict=True) if own)


def at_loosest(search: Searching, line: int, choice: float) -> bool:
    """Tell whether a tolerance is as loose as it may be, and can be written."""
    end, law = search.loosest[line], search.priced[line].law
    return choice > end - AT_END if law else choice == end


def _at_tightest(search: Searching, line: int, choice: float) -> bool:
    end, law = search.tightest[line], search.priced[line].law
    return choice < end + AT_END if law else choice == end


def costs_no_yield(search: Searching, proof: Proof, line: int) -> bool:
    """Tell whether the width of a tolerance, as far as it goes, costs no yield.

    Weighted machines tell where it does. Where they do not, fresh runs tell: of both
    ends of the tolerance with the same draws, so that of what does not matter no
    machine changes sides. None of a few is not enough: the whole interval of the share
    that does has to count as nothing, and both runs grow for it as a proof may.
    """
    choice, priced = proof.choice, search.priced[line]
    tightest, loosest = (_with(choice, line, end) for end in priced.ends)
    loose = at_loosest(search, line, choice[line])
    if not loose and not _at_tightest(search, line, choice[line]):
        return False  # it would be looser if that cost nothing
    little = FREE * search.permitted
    more, error = search.pool.apart(loosest, tightest)
    if np.any(more - CLEAR * error > little):
        return False
    runs = search.runs
    other = runs.as_written(tightest if loose else loosest)
    for trials in (proof.scheme.trials, runs.longest):
        ends = (choice, other) if loose else (other, choice)
        wide, narrow = (
            runs.of(each, proof.scheme.seed, least=trials).beyond for each in ends
        )
        both = min(wide.shape[1], narrow.shape[1])  # one may have grown before
        lost = np.count_nonzero(wide[:, :both] & ~narrow[:, :both], axis=1)
        shares = [proportion(count, both) for count in lost.tolist()]
        if np.all([each.upper for each in shares] < little):
            return True
        if np.any([each.value for each in shares] >= little):
            break
    return False


def _looser(priced: Priced, choice: float) -> float:
    """Return a choice a step looser: a tenth at most, or the next one offered."""
    if not priced.law:
        return choice - 1
    return min(choice + math.log(1 + LOOSER), priced.ends[1])


def _with(choice: Choice, line: int, chosen: float) -> Choice:
    return (*choice[:line], chosen, *choice[line + 1 :])
