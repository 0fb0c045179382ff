"""Angles of several turns where a formula turns a plain number into an angle by pi.

pi is no sign that radians were meant: in cos(s*pi*180) with s = 30 degrees became 2700
turns.
"""

import ast
import math
from collections.abc import Iterator, Mapping

from tolstat.machines.dimension_chain.algebras import OF_AN_ANGLE, Values
from tolstat.machines.dimension_chain.formula import Formula
from tolstat.units.scale import AS_IS

TURN = 2 * math.pi
BEYOND = 1 + 1e-9  # of a turn: more than a rounding error
SENTENCE = (
    "{} takes an angle of {} turns, with every link at its nominal value. Write an "
    'angle in degrees as a link with its unit, such as "30 deg", and without pi.'
)


def several_turns(
    formula: Formula, nominal: Mapping[str, float], units: Mapping[str, str]
) -> tuple[str, ...]:
    """Return a sentence for each sine, cosine or tangent of more than a turn by pi.

    A term counts that holds pi and a plain number: of a phase such as 2*pi*f*t, or of a
    link of several turns, that is what was meant.
    """

    def turns(part: ast.expr) -> float:
        return abs(float(formula.worked_out(Values(nominal), part))) / TURN

    def slipped(term: ast.expr) -> bool:
        names = {each.id for each in ast.walk(term) if isinstance(each, ast.Name)}
        kinds = {units[name] for name in names & units.keys()}
        plain = not kinds or "1" in kinds
        return "pi" in names - units.keys() and plain and turns(term) > BEYOND

    sentences = [
        SENTENCE.format(step, AS_IS.words(turns(step.arguments[0])))
        for step in formula.steps
        if step.name in OF_AN_ANGLE
        and turns(step.arguments[0]) > BEYOND
        and any(map(slipped, _terms(step.arguments[0])))
    ]
    return tuple(dict.fromkeys(sentences))


def _terms(part: ast.expr) -> Iterator[ast.expr]:
    """Yield the terms of a sum."""
    match part:
        case ast.BinOp(left=left, op=ast.Add() | ast.Sub(), right=right):
            yield from _terms(left)
            yield from _terms(right)
        case _:
            yield part
