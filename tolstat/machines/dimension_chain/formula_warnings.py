"""Warnings of a formula: slips, jumps where its links deviate.

A slip is a term that is computed as typed, and seldom meant so. An angle of several
turns, because pi is no sign that radians were meant: in cos(s*pi*180) with s = 30
degrees became 2700 turns. An angle that is turned into radians again. A natural
logarithm where decibels are meant.

Trials to either side of a jump, a branch cut or a pole, are far apart although their
parts are nearly equal: no statistics of the closing link means anything then.
"""

from __future__ import annotations

import ast
import math
from collections.abc import Iterator, Mapping
from contextlib import suppress
from typing import Any

import numpy as np

from tolstat.arrays import Array, Truths
from tolstat.deviations.spread import Spread
from tolstat.machines.dimension_chain.algebras import (
    CHOICE,
    OF_AN_ANGLE,
    PER_TIME,
    STEPS,
    Dimensions,
    Kind,
    Slopes,
    Values,
)
from tolstat.machines.dimension_chain.chain import links_at, points_of
from tolstat.machines.dimension_chain.formula import Formula, Step
from tolstat.units.scale import AS_IS, FIGURES, figures, scale_of

TURN = 2 * math.pi
BEYOND = 1 + 1e-9  # of a turn: more than a rounding error
HALF_TURNS = {180.0, 360.0}
DECIBELS = {10.0, 20.0}
SUM, PRODUCT = (ast.Add, ast.Sub), (ast.Mult, ast.Div)
SEVERAL_TURNS = (
    "{} takes an angle of {} turns, with every link at its nominal value. Write an "
    'angle in degrees as a link with its unit, such as "30 deg", and without pi.'
)
ARC = (
    "{}: the link of an angle is in radians here, also one typed in degrees; pi "
    "and 180 are not needed, as in r*phi."
)
FREQUENCY = (
    "{}: as the root of a stiffness over a mass it is in radians a second; a frequency "
    "in Hz is sqrt(k/m)/(2*pi)."
)
NATURAL = "{}: log is the natural logarithm; decibels are 20*log(x)/log(10)."


def slips(
    formula: Formula, nominal: Mapping[str, float], units: Mapping[str, str]
) -> tuple[str, ...]:
    """Return a sentence for each term that looks like a slip.

    `nominal` and `units` are SI, of each link.
    """
    sentences = [*several_turns(formula, nominal, units), *doubtful(formula, units)]
    return tuple(dict.fromkeys(sentences))


def several_turns(
    formula: Formula, nominal: Mapping[str, float], units: Mapping[str, str]
) -> Iterator[str]:
    """Yield a sentence for each sine, cosine or tangent of more than a turn by pi.

    A term counts that holds pi and a plain number: of a phase such as 2*pi*f*t, or of a
    link of several turns, that is what was meant.
    """

    def turns(part: ast.expr) -> float:
        return abs(float(formula.worked_out(Values(nominal), part))) / TURN

    def slipped(term: ast.expr) -> bool:
        names = {node.id for node in ast.walk(term) if isinstance(node, ast.Name)}
        kinds = {units[name] for name in names & units.keys()}
        plain = not kinds or "1" in kinds
        return "pi" in names - units.keys() and plain and turns(term) > BEYOND

    for step in formula.steps:
        angle = step.arguments[0]
        if step.name not in OF_AN_ANGLE or not turns(angle) > BEYOND:
            continue
        if any(map(slipped, operands(angle, SUM))):
            yield SEVERAL_TURNS.format(step, AS_IS.words(turns(angle)))


def doubtful(formula: Formula, units: Mapping[str, str]) -> Iterator[str]:
    """Yield a sentence for each product that is doubtful by its factors."""
    to_base_10 = "log(10" in formula.text.replace(" ", "")
    for product in products(formula.tree):
        factors = [*operands(product, PRODUCT)]
        names = {node.id for node in factors if isinstance(node, ast.Name)}
        numbers = {node.value for node in factors if isinstance(node, ast.Constant)}
        calls = [node.func for node in factors if isinstance(node, ast.Call)]
        angles = [name for name in names & units.keys() if units[name] == "rad"]
        if "pi" in names - units.keys() and angles and numbers & HALF_TURNS:
            yield ARC.format(ast.unparse(product))
        logs = [f for f in calls if isinstance(f, ast.Name) and f.id == "log"]
        if logs and numbers & DECIBELS and not to_base_10:
            yield NATURAL.format(ast.unparse(product))
    words = ast.unparse(formula.tree)
    turns = "pi" in words or "6.28" in words
    kind = formula.worked_out(Dimensions(units))
    if kind.dimension == PER_TIME and "sqrt" in words and not turns:
        yield FREQUENCY.format(formula.text)


def operands(part: ast.AST, signs: tuple[type[ast.operator], ...]) -> Iterator[Any]:
    """Yield what signs join: the terms of a sum, or the factors of a product."""
    if isinstance(part, ast.BinOp) and isinstance(part.op, signs):
        yield from operands(part.left, signs)
        yield from operands(part.right, signs)
    else:
        yield part


def products(part: ast.AST) -> Iterator[Any]:
    """Yield the products and quotients that are no factors of others."""
    factors = [*operands(part, PRODUCT)]
    if len(factors) > 1:
        yield part
    for child in factors if len(factors) > 1 else ast.iter_child_nodes(part):
        if not isinstance(child, ast.Name):
            yield from products(child)


PAIRS = 16  # of points, between which a jump is looked for
HALVINGS = 24  # of the way between two points
CONTINUOUS = 1e-3  # of the range of the gap: a smaller step is a slope
SENTENCE = (
    "{} jumps within the deviations of its links: {}. Fraction out of limit, "
    "quantiles, causes and advice depend on the jump; {}."
)
CUT = "where {} is below 0, from 180 to -180 deg as {} passes 0"
POLE = "it has a pole as {} passes {}"
OPPOSITE = "measure the angle from the opposite direction, as atan2({}, {})"
EDGES = {
    "floor": "whole numbers", "ceil": "whole numbers", "mod": "whole numbers",
    "round": "halves", "sign": "0",
}  # fmt: skip
CHANGES = "it changes where {} begins or ends to hold"
INTENDED = "slopes and root sum square do not see it"
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
    if step.name in ("atan2", "tan", "sign", *STEPS):
        return step.arguments[0]
    if step.name == "/":
        return step.arguments[1]
    if step.name == CHOICE:
        condition = step.arguments[0]
        assert isinstance(condition, ast.Compare)  # or the formula was refused
        return ast.BinOp(condition.left, ast.Sub(), condition.comparators[0])
    if step.name == "mod":
        return ast.BinOp(step.arguments[0], ast.Div(), step.arguments[1])
    if step.name == "**":
        with suppress(ValueError):  # a link
            power = ast.literal_eval(step.arguments[1])
            return step.arguments[0] if power < 0 and power % 2 == 1 else None
    return None


def _sides(step: Step, values: Array) -> Array:
    """Return a number of the side of the cut on which each value lies."""
    if step.name == "tan":
        return np.floor(values / np.pi + 0.5)
    if step.name in ("floor", "ceil", "mod"):
        return np.floor(values)
    if step.name == "round":
        return np.floor(values + 0.5)
    return np.where(values < 0, -1.0, 1.0)


def _pairs(points: Array, sides: Array) -> tuple[Array, Array]:
    """Return points to either side of a cut, near the start of both lists."""
    low: Truths = sides < np.max(sides, initial=-np.inf)
    first, second = points[low], points[~low]
    count = min(len(first), len(second), PAIRS)
    return first[:count], second[:count]


def _sentence(step: Step, part: ast.expr, values: Array, kind: Kind) -> str:
    if step.name == CHOICE:
        condition = ast.unparse(step.arguments[0])
        return SENTENCE.format(step, CHANGES.format(condition), INTENDED)
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
        return SENTENCE.format(
            step, cut, OPPOSITE.format(*map(_negative, step.arguments))
        )
    if step.name in EDGES:
        edge = f"it steps as {text} passes {EDGES[step.name]}"
        return SENTENCE.format(step, edge, INTENDED)
    edge = "an odd multiple of 90 deg" if step.name == "tan" else "0"
    return SENTENCE.format(step, POLE.format(text, edge), AVOID)


def _negative(part: ast.expr) -> str:
    """Return the text of a part with the other sign."""
    if isinstance(part, ast.UnaryOp) and isinstance(part.op, ast.USub):
        return ast.unparse(part.operand)
    return ast.unparse(ast.UnaryOp(ast.USub(), part))
