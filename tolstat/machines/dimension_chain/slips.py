"""Terms of a formula that are computed as typed, and seldom meant so.

An angle of several turns, because pi is no sign that radians were meant: in
cos(s*pi*180) with s = 30 degrees became 2700 turns. An angle that is turned into
radians again. A natural logarithm where decibels are meant.
"""

import ast
import math
from collections.abc import Iterator, Mapping
from typing import Any

from tolstat.machines.dimension_chain.algebras import OF_AN_ANGLE, Values
from tolstat.machines.dimension_chain.formula import Formula
from tolstat.units.scale import AS_IS

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
