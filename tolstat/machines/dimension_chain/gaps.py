"""Several closing links by name: their formulas, which may name each other."""

import ast
import re
from collections.abc import Mapping
from graphlib import CycleError, TopologicalSorter

from tolstat.errors import ModelError
from tolstat.machines.dimension_chain.formula import CONSTANTS, FUNCTIONS, Formula

MOST_STEPS = 20_000  # of a formula, those of the gaps that it names included
_WORD = re.compile(r"[^\W\d]\w*")


def formulas_of(texts: Mapping[str, str], links: tuple[str, ...]) -> dict[str, Formula]:
    """Return the formula of each gap, in the order of the texts.

    A gap that a formula names stands for its formula. Raises ModelError if a name is
    taken, gaps need each other, or a formula cannot be read.
    """
    for name in texts:
        if name in (*links, *FUNCTIONS, *CONSTANTS):
            kind = "a link" if name in links else "a word of formulas"
            raise ModelError(f"{name} is {kind}; choose another name for the gap")
    needed = {
        name: [word for word in dict.fromkeys(_WORD.findall(text)) if word in texts]
        for name, text in texts.items()
    }
    try:
        order = [*TopologicalSorter(needed).static_order()]
    except CycleError as error:
        circle = " needs ".join(reversed(error.args[1]))
        raise ModelError(f"{circle}; a gap cannot need itself") from None
    trees, steps = dict[str, ast.expr](), dict[str, int]()
    formulas = dict[str, Formula]()
    for name in order:
        text = texts[name]
        steps[name] = len(text) + sum(
            steps[word] for word in _WORD.findall(text) if word in texts
        )
        if steps[name] > MOST_STEPS:
            raise ModelError(
                f"{name}: with the gaps that it names the formula is longer than "
                f"{MOST_STEPS} characters"
            )
        formulas[name] = Formula(text, links, name, trees)
        trees = {**trees, name: formulas[name].tree}
    return {name: formulas[name] for name in texts}
