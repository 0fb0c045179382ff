"""Formulas of a chain as expressions that a page's script evaluates."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from tolstat.deviations.spread import Spread
from tolstat.machines.dimension_chain.algebras import CHOICE, COMPARISONS
from tolstat.machines.dimension_chain.chain import answers
from tolstat.machines.dimension_chain.declarations import Settings
from tolstat.model.contract import Model
from tolstat.model.in_cases import ModelInCases

SAME = "{}"  # name of a response without cases
# what JavaScript calls otherwise, and what the script defines; else as of its `Math`
SCRIPTED = {"power": "Math.pow", "mod": "mod", "round": "even"}


@dataclass(frozen=True)
class Script:
    """An algebra of JavaScript: values are expressions of trial k of columns x."""

    nominal: Mapping[str, float]  # SI, of every link
    parts: Sequence[str]  # links that deviate, by their place
    unchanged: Mapping[str, float]  # nominal values without the changes of a case

    def constant(self, value: float) -> str:
        """Return a number."""
        return repr(float(value))

    def link(self, name: str) -> str:
        """Return a part, or the size of a link that does not deviate."""
        if name not in self.parts:
            return self.constant(self.nominal[name])
        part = f"x[{self.parts.index(name)}][k]"
        change = float(self.nominal[name] - self.unchanged[name])
        return f"({part}+({change!r}))" if change else part

    def operation(self, sign: str, first: str, second: Any) -> str:
        """Return a step of two arguments."""
        if sign == "**":
            return f"Math.pow({first},{second!r})"
        # a long sum is flat: a script cannot have many brackets in each other
        return f"{first if sign in '+-' else f'({first})'}{sign}({second})"

    def function(self, name: str, arguments: Sequence[str]) -> str:
        """Return a step of a function."""
        if name == CHOICE:
            return "(({})?({}):({}))".format(*arguments)
        if name in COMPARISONS:
            return name.join(f"({argument})" for argument in arguments)
        return f"{SCRIPTED.get(name, f'Math.{name}')}({','.join(arguments)})"


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

    def scripts(self, parts: Collection[str]) -> dict[str, str]:
        """Return the formula of each response as an expression of these parts."""
        scripts = dict[str, str]()
        for pattern, case in self.cases.items():
            algebra: Any = Script(case.nominal, [*parts], self.settings.nominal)
            for name, formula in case.formulas.items():
                scripts[pattern.format(name)] = formula.worked_out(algebra)
        return scripts

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
