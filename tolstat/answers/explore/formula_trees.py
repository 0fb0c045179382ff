"""Formulas of a chain as data: trees of steps, which a page evaluates."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from tolstat.deviations.spread import Spread
from tolstat.machines.dimension_chain.chain import answers
from tolstat.machines.dimension_chain.declarations import Settings
from tolstat.model.contract import Model
from tolstat.model.in_cases import ModelInCases

Tree = float | list[Any]  # a number, ["link", part], or a step and its arguments
SAME = "{}"  # name of a response without cases


@dataclass(frozen=True)
class Trees:
    """An algebra of trees: a step is its name and its arguments."""

    nominal: Mapping[str, float]  # SI, of every link
    parts: Sequence[str]  # links that deviate, by their place
    unchanged: Mapping[str, float]  # nominal values without the changes of a case

    def constant(self, value: float) -> Tree:
        """Return a number."""
        return float(value)

    def link(self, name: str) -> Tree:
        """Return a part, or the size of a link that does not deviate."""
        if name not in self.parts:
            return float(self.nominal[name])
        part = ["link", self.parts.index(name)]
        change = float(self.nominal[name] - self.unchanged[name])
        return ["+", part, change] if change else part

    def operation(self, sign: str, first: Tree, second: Any) -> Tree:
        """Return a step of two arguments."""
        return [sign, first, second]

    def function(self, name: str, arguments: Sequence[Tree]) -> Tree:
        """Return a step of a function."""
        return [name, *arguments]


class ChainFormulas:
    """The formulas of a chain, in each of its cases.

    Parameters
    ----------
    model, settings
        Of a study. A model that is not a chain has no formulas, nor has a chain with
        vector loops, lots or uncertain means: these are solved, or evaluated twice.
    """

    def __init__(self, model: Model, settings: Any) -> None:
        self.settings = settings
        self.cases = dict(_cases(model, settings))  # by the pattern of a response

    def trees(self, parts: Collection[str]) -> dict[str, Tree]:
        """Return the formula of each response as a tree of these parts."""
        trees = dict[str, Tree]()
        for pattern, case in self.cases.items():
            algebra: Any = Trees(case.nominal, [*parts], self.settings.nominal)
            for name, formula in case.formulas.items():
                trees[pattern.format(name)] = formula.worked_out(algebra)
        return trees

    def turning(self, spreads: Mapping[str, Spread]) -> dict[str, str]:
        """Return the links by which each response both rises and falls, in words.

        Slopes tell neither its worst case nor its spread then; empty where they do.
        """
        return {
            pattern.format(name): ", ".join(
                answers(formula, case.nominal, spreads).turning
            )
            for pattern, case in self.cases.items()
            for name, formula in case.formulas.items()
        }

    @property
    def changed(self) -> frozenset[str]:
        """Links whose size some case changes: a case replaces what a study has."""
        nominal = self.settings.nominal if self.cases else {}
        sizes = [case.nominal for case in self.cases.values()]
        return frozenset(n for n, x in nominal.items() if any(y[n] != x for y in sizes))


def _cases(model: Model, settings: Any) -> Iterator[tuple[str, Settings]]:
    """Yield the settings of each case by the pattern of its responses."""
    if not isinstance(settings, Settings) or settings.closed:
        return
    if model.unwrapped is model:
        yield SAME, settings
    elif isinstance(model, ModelInCases) and model.base is model.unwrapped:
        for case in model.conditions:
            yield case.of(SAME), case.settings(settings)
