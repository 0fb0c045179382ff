"""Jumps of a formula where its links deviate: branch cuts and poles.

Trials to either side of a jump are far apart although their parts are nearly equal: no
statistics of the closing link means anything then.
"""

from __future__ import annotations

import ast
from collections.abc import Mapping

import numpy as np

from tolstat.arrays import Array, Truths
from tolstat.deviations.spread import Spread
from tolstat.machines.dimension_chain.algebras import Dimensions, Kind, Slopes, Values
from tolstat.machines.dimension_chain.chain import links_at, points_of
from tolstat.machines.dimension_chain.formula import Formula, Step
from tolstat.units.scale import FIGURES, figures, scale_of

PAIRS = 16  # of points, between which a jump is looked for
HALVINGS = 24  # of the way between two points
CONTINUOUS = 1e-3  # of the range of the gap: a smaller step is a slope
SENTENCE = (
    "{} jumps within the deviations of its links: {}. Fraction out of limit, "
    "quantiles, causes and advice depend on the jump; {}."
)
CUT = "where {} is below 0, from 180 to -180 deg as {} passes 0"
POLE = "it has a pole as {} passes {}"
TURN = "measure the angle from the opposite direction, as atan2({}, {})"
AVOID = "write the formula without it, or narrow the tolerances"


def jumps(
    formula: Formula,
    nominal: Mapping[str, float],
    spreads: Mapping[str, Spread],
    units: Mapping[str, str],
) -> tuple[str, ...]:
    """Return a sentence for each step of a formula that jumps where its links deviate.

    `spreads` go from end to end of what parts reach.

    A step may jump where its arguments lie on both sides of a cut, at corners of the
    deviations or inside them. It does if the closing link differs by much right beside
    the cut: cos(atan2(y, x)) does not.
    """
    names = [name for name in spreads if name in formula.used]
    ends = np.array([spreads[n][:2] for n in names]).reshape(-1, 2)
    size = np.array([nominal[n] for n in names])
    lower, upper = size + ends[:, 0], size + ends[:, 1]
    if not names or not np.all(np.isfinite([lower, upper])):
        return ()
    inside = points_of(lower, upper)

    def valued(points: Array, part: ast.expr | None = None) -> Array:
        links = Values(links_at(points, names, nominal))
        value = formula.worked_out(links, part)
        return np.broadcast_to(value, len(points)).astype(float)

    def steepest(part: ast.expr) -> Array:
        """Return the corners where a part is least and largest if it is monotonic."""
        middle = {**nominal, **dict(zip(names, (lower + upper) / 2, strict=True))}
        slopes = formula.worked_out(Slopes(middle), part).by_link
        rises = slopes[[list(middle).index(n) for n in names]] > 0
        return np.stack([np.where(rises, lower, upper), np.where(rises, upper, lower)])

    def jumping(step: Step, part: ast.expr) -> Array | None:
        """Return the values of the part that passes a cut; None without a jump."""
        points = np.vstack([inside, steepest(part)])
        values = valued(points, part)
        where = np.isfinite(values)
        if step.name == "atan2":
            where &= valued(points, step.arguments[1]) < 0
        first, second = _pairs(points[where], _sides(step, values[where]))
        if not len(first):
            return None
        start = _sides(step, valued(first, part))
        for _ in range(HALVINGS):
            half = (first + second) / 2
            same = (_sides(step, valued(half, part)) == start)[:, None]
            first, second = np.where(same, half, first), np.where(same, second, half)
        with np.errstate(all="ignore"):
            steps = np.abs(valued(first) - valued(second))
        gap = valued(points)
        gap = gap[np.isfinite(gap)]
        if step.name == "atan2":
            steps = steps[valued(first, step.arguments[1]) < 0]
        if not np.any(~(steps <= CONTINUOUS * np.ptp(gap))):
            return None
        return values[where]

    sentences = []
    for step in formula.steps:
        if (part := _crossing(step)) is None:
            continue
        if (values := jumping(step, part)) is not None:
            kind: Kind = formula.worked_out(Dimensions(units), part)
            sentences.append(_sentence(step, part, values, kind))
    return tuple(dict.fromkeys(sentences))


def _crossing(step: Step) -> ast.expr | None:
    """Return the part of a step that may pass a cut; None of a step without one."""
    if step.name in ("atan2", "tan"):
        return step.arguments[0]
    if step.name == "/":
        return step.arguments[1]
    if step.name == "**" and (power := ast.literal_eval(step.arguments[1])) < 0:
        return step.arguments[0] if power % 2 == 1 else None
    return None


def _sides(step: Step, values: Array) -> Array:
    """Return a number of the side of the cut on which each value lies."""
    if step.name == "tan":
        return np.floor(values / np.pi + 0.5)
    return np.where(values < 0, -1.0, 1.0)


def _pairs(points: Array, sides: Array) -> tuple[Array, Array]:
    """Return points to either side of a cut, near the start of both lists."""
    low: Truths = sides < np.max(sides, initial=-np.inf)
    first, second = points[low], points[~low]
    count = min(len(first), len(second), PAIRS)
    return first[:count], second[:count]


def _sentence(step: Step, part: ast.expr, values: Array, kind: Kind) -> str:
    scale = scale_of(
        kind.unit, "deg" if kind.unit == "rad" else "", np.abs(values).max()
    )
    if kind.unit == "1":
        scale = scale_of("1", "1")
    # what parts reach errs by more than the last figure that `figures` keeps
    ends = (
        float(f"{scale.factor * x:.{FIGURES}g}") for x in (values.min(), values.max())
    )
    words = " to ".join(f"{figures(x)} {scale.mark}".strip() for x in ends)
    text = f"{ast.unparse(part)} ({words})"
    if step.name == "atan2":
        cut = CUT.format(ast.unparse(step.arguments[1]), text)
        return SENTENCE.format(step, cut, TURN.format(*map(_negative, step.arguments)))
    edge = "an odd multiple of 90 deg" if step.name == "tan" else "0"
    return SENTENCE.format(step, POLE.format(text, edge), AVOID)


def _negative(part: ast.expr) -> str:
    """Return the text of a part with the other sign."""
    if isinstance(part, ast.UnaryOp) and isinstance(part.op, ast.USub):
        return ast.unparse(part.operand)
    return ast.unparse(ast.UnaryOp(ast.USub(), part))
