"""Formulas of a chain as data: trees of steps, which a page evaluates."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from tolstat.deviations.spread import Spread
from tolstat.machines.dimension_chain.chain import answers
from tolstat.machines.dimension_chain.declarations import Settings

Tree = float | list[Any]  # a number, ["link", part], or a step and its arguments


@dataclass(frozen=True)
class Trees:
    """An algebra of trees: a step is its name and its arguments."""

    nominal: Mapping[str, float]  # SI, of every link
    parts: Sequence[str]  # links that deviate, by their place

    def constant(self, value: float) -> Tree:
        """Return a number."""
        return float(value)

    def link(self, name: str) -> Tree:
        """Return a part, or the size of a link that does not deviate."""
        if name in self.parts:
            return ["link", self.parts.index(name)]
        return float(self.nominal[name])

    def operation(self, sign: str, first: Tree, second: Any) -> Tree:
        """Return a step of two arguments."""
        return [sign, first, second]

    def function(self, name: str, arguments: Sequence[Tree]) -> Tree:
        """Return a step of a function."""
        return [name, *arguments]


def formula_trees(settings: Any, parts: Collection[str]) -> dict[str, Tree] | None:
    """Return the formula of each response as a tree of these parts.

    None of a model that is not a chain, and of a chain with vector loops: they are
    solved, not evaluated.
    """
    if not isinstance(settings, Settings) or settings.closed:
        return None
    algebra: Any = Trees(settings.nominal, [*parts])
    return {n: formula.worked_out(algebra) for n, formula in settings.formulas.items()}


def turning_links(settings: Settings, spreads: Mapping[str, Spread]) -> dict[str, str]:
    """Return the links by which each response both rises and falls, in words.

    Slopes tell neither its worst case nor its spread then; empty where they do.
    """
    nominal = settings.nominal
    return {
        name: ", ".join(answers(formula, nominal, spreads).turning)
        for name, formula in settings.formulas.items()
    }
