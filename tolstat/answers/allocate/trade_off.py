"""The trade-off, the best at equal cost, and what slopes alone would choose."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from tolstat.answers.allocate.fresh_runs import Proof, Scheme
from tolstat.answers.allocate.linear_schemes import LinearSchemes
from tolstat.answers.allocate.optimizer import Choice, cheapest
from tolstat.answers.allocate.search import Search
from tolstat.execution.run_loop import Progress
from tolstat.model.view import Axis, Chart, Curve, Mark, Panel

CURVE = 2.0 ** np.arange(-4.5, 5.0, 1.5)  # times the fraction out of any limit
BISECTIONS = 5
FEWER = 100  # times fewer trials out of limit than on the curve
OUT = Axis("fraction out of any limit", "1", "ppm", logarithmic=True)
BELOW = 0.1  # of the least fraction: lower ends of intervals are shown so far


@dataclass(frozen=True)
class Point:
    """The cheapest tolerances for some fraction out of any limit, and their cost."""

    fraction_out_of_any_limit: float  # the median by weighted trials
    cost: float
    choice: Choice = field(metadata={"json": False})


def points_about(search: Search, start: Choice) -> list[Point]:
    """Find the cheapest tolerances for fractions about that of an allocation."""
    points, reference = [], search.out_of_any_limit(start)
    search.runs.tell(Progress(0, 0, 0, "trade-off"))
    for times in CURVE[::-1]:
        share = min(float(times) * reference, 1.0)
        if found := search.cheapest_for(share, start):
            start = found.choice
            points.append(Point(share, found.cost, start))
    return points


def own_fractions(search: Search, points: list[Point]) -> list[Point]:
    """Return each set of tolerances once, at its own fraction out of any limit.

    One set of options of lists is the cheapest for many fractions.
    """
    return [
        replace(each, fraction_out_of_any_limit=search.out_of_any_limit(each.choice))
        for each in {each.choice: each for each in points}.values()
    ]


def at_equal_cost(search: Search, points: list[Point], seed: int) -> Proof:
    """Run the best tolerances for the cost of the drawing; or the drawing's own.

    Weighted trials may promise what a run does not keep: then they are the drawing's.
    """
    specified = search.runs.of(search.specified, seed)
    spent = search.runs.of(for_equal_cost(search, points), seed)
    own, other = (each.scheme.fraction_out_of_any_limit for each in (specified, spent))
    return spent if other.value <= own.value else specified


def for_equal_cost(search: Search, points: list[Point]) -> Choice:
    """Find the tolerances with the fewest out of limit for the cost of the drawing."""
    runs = search.runs
    cost = runs.cost(search.specified)
    least, best = search.out_of_any_limit(search.specified), search.specified
    for each in points:
        written = runs.as_written(each.choice)
        if each.fraction_out_of_any_limit < least and runs.cost(written) <= cost:
            least, best = each.fraction_out_of_any_limit, written
    high = math.log(least)
    shares = [each.fraction_out_of_any_limit for each in points]
    fewer = [share for share in shares if share < least]
    low = math.log(max(fewer)) if fewer else high - math.log(FEWER)
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        found = search.cheapest_for(math.exp(middle), best)
        if found and runs.cost(written := runs.as_written(found.choice)) <= cost:
            best, high = written, middle
        else:
            low = middle
    return best


def linear_choices(search: Search) -> tuple[dict[str, Choice], dict[str, str]]:
    """Allocate as linear analysis does; and say why that is not possible."""
    linear = LinearSchemes(search.runs.study, search.runs.workers)
    bounds = {
        "root_sum_square": linear.root_sum_square,
        "worst_case": linear.worst_case,
    }
    if not linear.known:
        return {}, dict.fromkeys(bounds, "the model has a response without a slope")
    found, omitted = dict[str, Choice](), dict[str, str]()
    for name, excess in bounds.items():
        if best := cheapest(search.variables, excess, search.tightest):
            found[name] = search.runs.as_written(best.choice)
        else:
            omitted[name] = "no tolerances meet the limits"
    return found, omitted


def trade_off_chart(
    points: Sequence[Point], schemes: Mapping[str, Scheme], *, listed: bool = False
) -> Chart:
    """Draw the cost of the cheapest tolerances over the fraction out of any limit.

    Points in order are a curve, or dots where every tolerance is of a list: nothing
    lies between them. Schemes are dots with intervals; equal ones, by words, are drawn
    once, by the longest run.
    """
    at = np.array([each.fraction_out_of_any_limit for each in points])
    costs = np.array([each.cost for each in points])
    sentence = "cost of the cheapest tolerances"
    curves, marks = [Curve("cheapest", "1", "", sentence, costs, points=listed)], []
    equal: dict[tuple[str, ...], list[str]] = {}
    for name, scheme in schemes.items():
        equal.setdefault(tuple(scheme.tolerances.values()), []).append(name)
    for names in equal.values():
        scheme = max((schemes[name] for name in names), key=lambda each: each.trials)
        share, lower, upper, _ = scheme.fraction_out_of_any_limit
        words, ends = " = ".join(names), np.array([lower, share, upper])
        if share > 0:
            marks.append(Mark(words, share, scheme.cost))
        else:  # has no place on an axis of ratios
            words += f", {scheme.cost:.4g}: none of {scheme.trials} out of limit"
            ends = np.array([lower, upper])
        values = np.full(len(ends), scheme.cost)
        curves.append(Curve(words, "1", "", "tolerances beside it", values, ends))
    # an interval that reaches far below all else leaves no room for that
    uppers = [each.fraction_out_of_any_limit.upper for each in schemes.values()]
    least = BELOW * min([*at.tolist(), *(mark.at for mark in marks), *uppers])
    panel = Panel("cost", tuple(each.name for each in curves))
    return Chart(
        OUT._replace(least=least),
        at,
        tuple(curves),
        marks=tuple(marks),
        panels=(panel,),
    )
