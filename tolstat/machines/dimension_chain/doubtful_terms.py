"""Terms of a formula that are computed as typed, and seldom meant so."""

import ast
from collections.abc import Iterator, Mapping

from tolstat.machines.dimension_chain.formula import Formula

HALF_TURNS = (180.0, 360.0)
DECIBELS = (10.0, 20.0)
ARC = (
    "{}: the link of an angle is in radians here, also one typed in degrees; pi "
    "and 180 are not needed, as in r*phi."
)
NATURAL = "{}: log is the natural logarithm; decibels are 20*log(x)/log(10)."


def doubtful_terms(formula: Formula, units: Mapping[str, str]) -> tuple[str, ...]:
    """Return a sentence for each product that looks like a slip.

    `units` are SI, of each link. An angle that is turned into radians again, and a
    natural logarithm where decibels are meant.
    """
    plain = formula.text.replace(" ", "")
    sentences = list[str]()
    for product in _products(formula.tree):
        factors = [*_factors(product)]
        names = {each.id for each in factors if isinstance(each, ast.Name)}
        numbers = {each.value for each in factors if isinstance(each, ast.Constant)}
        calls = [each.func for each in factors if isinstance(each, ast.Call)]
        angles = [name for name in names & units.keys() if units[name] == "rad"]
        if "pi" in names - units.keys() and angles and numbers & {*HALF_TURNS}:
            sentences.append(ARC.format(ast.unparse(product)))
        logs = [
            each for each in calls if isinstance(each, ast.Name) and each.id == "log"
        ]
        if logs and numbers & {*DECIBELS} and "log(10" not in plain:
            sentences.append(NATURAL.format(ast.unparse(product)))
    return tuple(dict.fromkeys(sentences))


def _products(part: ast.AST) -> Iterator[ast.expr]:
    """Yield the products and quotients that are no factors of others."""
    if _is_product(part):
        yield part  # type: ignore[misc]
        inner = [leaf for leaf in _factors(part) if not isinstance(leaf, ast.Name)]
    else:
        inner = [*ast.iter_child_nodes(part)]  # type: ignore[list-item]
    for child in inner:
        yield from _products(child)


def _factors(part: ast.AST) -> Iterator[ast.expr]:
    """Yield the factors of a product, those below a fraction line too."""
    if _is_product(part):
        yield from _factors(part.left)  # type: ignore[attr-defined]
        yield from _factors(part.right)  # type: ignore[attr-defined]
    elif isinstance(part, ast.expr):
        yield part


def _is_product(part: ast.AST) -> bool:
    return isinstance(part, ast.BinOp) and isinstance(part.op, ast.Mult | ast.Div)
