"""What lies beside an allocation: the trade-off, and what slopes alone would choose."""

from __future__ import annotations

import math

import numpy as np

from tolstat.answers.allocate.allocation import Point
from tolstat.answers.allocate.fresh_runs import Proof
from tolstat.answers.allocate.linear_schemes import LinearSchemes
from tolstat.answers.allocate.optimizer import Choice, cheapest
from tolstat.answers.allocate.search import Searching
from tolstat.execution.run_loop import Progress

CURVE = 2.0 ** np.arange(-4.5, 5.0, 1.5)  # times the share beyond any limit
BISECTIONS = 5
FEWER = 100  # times fewer machines beyond than on the curve


def points_about(search: Searching, start: Choice) -> list[Point]:
    """Find the cheapest tolerances for other shares beyond any limit.

    Parameters
    ----------
    search : Searching
        Whose weighted machines tell.
    start : tuple of float
        The allocation about whose share they lie.
    """
    points, reference = [], search.beyond_any(start)
    search.runs.tell(Progress(0, 0, 0, "trade-off"))
    for times in CURVE[::-1]:
        share = min(float(times) * reference, 1.0)
        if found := search.cheapest_for(share, start):
            start = found.choice
            points.append(Point(found.cost, share, start))
    return points


def own_shares(search: Searching, points: list[Point]) -> list[Point]:
    """Return each set of tolerances once, at the share that is beyond with it.

    Parameters
    ----------
    search, points
        As of `points_about`: of lists one set is the cheapest for many shares.
    """
    sets = {each.choice: each for each in points}.values()
    return [each._replace(beyond=search.beyond_any(each.choice)) for each in sets]


def at_the_cost_drawn(search: Searching, points: list[Point], seed: int) -> Proof:
    """Run what puts the fewest beyond for the cost as drawn: found, or as drawn.

    Parameters
    ----------
    search, points
        As of `for_the_cost_drawn`; notes where nothing is shown to be better than as
        drawn.
    seed : int
        Of the fresh runs of both.
    """
    drawn = search.runs.of(search.drawn, seed)
    spent = search.runs.of(for_the_cost_drawn(search, points), seed)
    # weighted machines may promise what a run does not keep
    more = spent.scheme.beyond_any.value - drawn.scheme.beyond_any.value
    if spent.choice != search.drawn and more <= 0:
        if more == 0:
            search.notes.append(
                "at the cost drawn as many machines are beyond as with the tolerances "
                f"drawn in runs of {spent.scheme.trials}, which do not tell them "
                "apart; weighted machines say fewer"
            )
        return spent
    search.notes.append(
        "no tolerances were found that put fewer machines beyond the limits for the "
        "cost as drawn"
    )
    return drawn


def for_the_cost_drawn(search: Searching, points: list[Point]) -> Choice:
    """Find the tolerances that seem to put the fewest beyond for the cost as drawn.

    Parameters
    ----------
    search
        As of `points_about`.
    points : list of Point
        Of the curve.
    """
    runs = search.runs
    cost = runs.cost(search.drawn)
    least, best = search.beyond_any(search.drawn), search.drawn
    for each in points:
        written = runs.as_written(each.choice)
        if each.beyond < least and runs.cost(written) <= cost:
            least, best = each.beyond, written
    high = math.log(least)
    dearer = [each.beyond for each in points if each.beyond < least]
    low = math.log(max(dearer)) if dearer else high - math.log(FEWER)
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        found = search.cheapest_for(math.exp(middle), best)
        if found and runs.cost(written := runs.as_written(found.choice)) <= cost:
            best, high = written, middle
        else:
            low = middle
    return best


def linear_answers(search: Searching) -> dict[str, Choice]:
    """Allocate as linear analysis does.

    Parameters
    ----------
    search : Searching
        Notes what cannot be allocated so.
    """
    linear = LinearSchemes(search.runs.study, search.runs.workers)
    if not linear.known:
        search.notes.append("no worst case and root sum square: slopes are not known")
        return {}
    choices = {}
    for name, excess in (
        ("root sum square", linear.root_sum_square),
        ("worst case", linear.worst_case),
    ):
        if found := cheapest(search.variables, excess, search.tightest):
            choices[name] = search.runs.as_written(found.choice)
        else:
            search.notes.append(f"no tolerances meet the limits by {name}")
    return choices
