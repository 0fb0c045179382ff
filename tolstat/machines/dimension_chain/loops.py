"""Vector loops in the plane, and the unknowns that close them.

A loop is a sum of vectors that ends where it began, each a length and its direction:
"crank @ phi + rod @ theta - slide @ 0 deg". Names in it that are no links are unknown.
They are solved for in every trial, from the machine with all links at their nominal
values. The implicit function theorem gives their slopes, exact as those of a formula.

References
----------
K. W. Chase, J. Gao, S. P. Magleby, General 2-D tolerance analysis of mechanical
assemblies with small kinematic adjustments, J. Design and Manufacturing 5 (1995).
"""

import ast
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from tolstat.arrays import Array, Truths
from tolstat.errors import ModelError, UnitError, allowed_names
from tolstat.machines.dimension_chain.algebras import (
    Dimensions,
    Roundings,
    Slope,
    Slopes,
)
from tolstat.machines.dimension_chain.closing import Closing, Solution
from tolstat.machines.dimension_chain.formula import (
    CONSTANTS,
    FUNCTIONS,
    Formula,
    typed_units,
)
from tolstat.units.grammar import Measure, measure
from tolstat.units.scale import Scale, scale_of

ALONG = "cos", "sin"  # the equations of a loop: along 0 deg and along 90 deg
EXAMPLE = "crank @ phi + rod @ theta - slide @ 0 deg"
MOST_WAYS = 3  # in a message
DEAD_POINT = 1e6  # of the slopes of the unknowns, in their sizes
_WORD = re.compile(r"(?<![\w.])[^\W\d]\w*")


@dataclass(frozen=True)
class Loops:
    """Vector loops, read, and their unknowns.

    Raises ModelError if a loop cannot be read, if there are more or fewer unknowns than
    equations, or if no way to close is the one that is meant, with all links nominal.
    """

    texts: Mapping[str, str]  # loops by name; without @ the start of an unknown
    links: Mapping[str, Measure]  # nominal values

    def __post_init__(self) -> None:
        """Read them, and solve them once."""
        _ = self._nominal

    @cached_property
    def _loops(self) -> dict[str, str]:
        return {name: text for name, text in self.texts.items() if "@" in text}

    @cached_property
    def unknowns(self) -> tuple[str, ...]:
        """Names in the loops that are no links: two for each loop."""
        taken = {*self.links, *FUNCTIONS, *CONSTANTS, "if"}
        plain, _ = typed_units(" ".join(self._loops.values()), self.links)
        words = dict.fromkeys(_WORD.findall(plain))
        unknowns = tuple(word for word in words if word not in taken)
        for name, text in self.texts.items():
            if name in (*self.links, *FUNCTIONS, *CONSTANTS):
                raise ModelError(f"{name} is a link or a word of formulas already")
            if name not in (*self._loops, *unknowns):
                allowed = allowed_names(name, unknowns) if unknowns else ""
                raise ModelError(
                    f"{name} = {text!r} is neither a loop, such as {EXAMPLE!r}, nor "
                    f"the start of an unknown; {allowed}".rstrip("; ")
                )
        count = len(ALONG) * len(self._loops)
        if len(unknowns) != count:
            names = f" ({', '.join(unknowns)})" if unknowns else ""
            raise ModelError(
                f"{', '.join(self._loops)}: {len(unknowns)} unknowns{names}, but "
                f"{count} equations, two for each loop; names that are no links are "
                "unknown"
            )
        return unknowns

    @cached_property
    def used(self) -> tuple[str, ...]:
        """The links that determine the unknowns."""
        names = {name for equation in self._equations for name in equation.used}
        return tuple(name for name in self.links if name in names)

    @cached_property
    def _equations(self) -> tuple[Formula, ...]:
        names = (*self.links, *self.unknowns)
        return tuple(
            Formula(text, names, name, along=along)
            for name, text in self._loops.items()
            for along in ALONG
        )

    @cached_property
    def _lengths(self) -> tuple[str, ...]:
        """SI unit of the lengths of each equation; it may be newton, of forces."""
        units = []
        for equation in self._equations:
            turning = _in_directions(equation.tree)
            lengths = (n for n in equation.used if n in self.links and n not in turning)
            name = next(lengths, None)
            units.append(self.links[name].unit if name else "m")
        return tuple(units)

    @cached_property
    def _starts(self) -> dict[str, Measure]:
        starts = {}
        for name in self.unknowns:
            if name in self.texts:
                try:
                    starts[name] = measure(self.texts[name])
                except UnitError as error:
                    text = f"{name} = {self.texts[name]!r}"
                    raise ModelError(f"{text}: {error}") from None
        return starts

    @cached_property
    def scales(self) -> dict[str, Scale]:
        """How each unknown is shown: as its start, or as it stands in its loop."""
        scales = {}
        for name in self.unknowns:
            for equation, length in zip(self._equations, self._lengths, strict=True):
                if name in _names(equation.tree):
                    angle = name in _in_directions(equation.tree)
                    scales[name] = scale_of(
                        *(("rad", "deg") if angle else (length, ""))
                    )
            if name in self._starts:
                start = self._starts[name]
                scales[name] = scale_of(start.unit, start.shown)
        return scales

    @property
    def units(self) -> dict[str, str]:
        """SI unit of each unknown."""
        return {name: scale.unit for name, scale in self.scales.items()}

    @cached_property
    def _sizes(self) -> tuple[Array, Array]:
        """Sizes of unknowns and of equations, SI: both are solved in these."""
        sizes = dict.fromkeys(self._lengths, 0.0) | {"rad": 0.0}
        for name in self.used:
            link = self.links[name]
            if link.unit in sizes and link.unit != "rad":
                sizes[link.unit] += abs(link.value)
        sizes = {unit: size or 1.0 for unit, size in sizes.items()}
        unknowns = [sizes.get(unit, 1.0) for unit in self.units.values()]
        return np.array(unknowns), np.array([sizes[unit] for unit in self._lengths])

    @cached_property
    def _closing(self) -> Closing:
        units = {name: link.unit for name, link in self.links.items()} | self.units
        for equation in self._equations:
            equation.worked_out(Dimensions(units))
        angles = np.array([unit == "rad" for unit in self.units.values()])
        return Closing(self._linear, angles)

    def _linear(
        self, links: Mapping[str, Array], unknowns: Array
    ) -> tuple[Array, Array]:
        """Return residuals and slopes in the equations' sizes: see `Closing`."""
        sizes, of_equations = self._sizes
        values = dict(zip(self.unknowns, sizes[:, None] * unknowns, strict=True))
        none = np.zeros(unknowns.shape)
        fixed = {name: Slope(value, none) for name, value in links.items()}
        algebra = Slopes(values, solved=fixed)
        rows = [equation.worked_out(algebra) for equation in self._equations]
        residuals = np.array([np.broadcast_to(r.value, none[0].shape) for r in rows])
        slopes = np.array([np.broadcast_to(r.by_link, none.shape) for r in rows])
        slopes = slopes * sizes[:, None] / of_equations[:, None, None]
        return residuals / of_equations[:, None], np.moveaxis(slopes, 2, 0)

    @cached_property
    def _nominal_links(self) -> dict[str, float]:
        return {name: link.value for name, link in self.links.items()}

    @cached_property
    def _nominal(self) -> Solution:
        """How the nominal machine closes.

        Of several ways it is the one nearest to the starts, then one whose lengths are
        positive.
        """
        sizes, of_equations = self._sizes
        closing, nominal = self._closing, self._nominal_links
        starts = {
            i: self._starts[name].value / sizes[i]
            for i, name in enumerate(self.unknowns)
            if name in self._starts
        }
        ways = closing.ways(nominal, starts)
        positive = np.all(ways[:, ~closing.angles] > 0, axis=1)
        if len(ways) > 1 and positive.any():
            ways = ways[positive]
        names = ", ".join(self._loops)
        at_nominal = "with every link at its nominal value"
        if not len(ways):
            miss = np.abs(of_equations * closing.nearest_miss(nominal))
            scale = scale_of(self._lengths[miss.argmax()], "", miss.max())
            words = f"{scale.number(miss.max(), 2)} {scale.mark}"
            raise ModelError(
                f"{names} does not close {at_nominal}: about {words} are missing"
            )
        if len(ways) > 1:
            several = "; or ".join(map(self._words, ways[:MOST_WAYS]))
            first = self.unknowns[0]
            start = self.scales[first].words(ways[0, 0] * sizes[0])
            raise ModelError(
                f"{names} closes in {len(ways)} ways {at_nominal}: {several}; give the "
                f'right one as a start, such as {first} = "{start}"'
            )
        one = {name: np.full(1, value) for name, value in nominal.items()}
        solution = closing.newton(one, ways.T)
        if not np.max(np.abs(solution.inverse)) < DEAD_POINT:
            raise ModelError(
                f"{names} is at a dead point {at_nominal}: the slightest deviation "
                "moves it, or keeps it from closing"
            )
        return solution

    def _words(self, way: Array) -> str:
        values = zip(self.scales.items(), self._sizes[0] * way, strict=True)
        return ", ".join(f"{name} = {scale.words(x)}" for (name, scale), x in values)

    def _solution(self, links: Mapping[str, Any]) -> tuple[Solution, tuple[int, ...]]:
        """Return the solution at links, SI, and the shape of these."""
        arrays = np.broadcast_arrays(*(links[name] for name in self.links))
        shape = arrays[0].shape
        flat = [np.ravel(x) for x in arrays]
        trials = dict(zip(self.links, flat, strict=True))
        nominal = self._nominal
        return self._closing.from_nominal(self._nominal_links, trials, nominal), shape

    def close(self, algebra: Roundings) -> Truths:
        """Tell which trials of an algebra that has the unknowns close."""
        closed: Truths = ~np.isnan(algebra.solved[self.unknowns[0]].value)
        return closed

    @property
    def turning(self) -> tuple[str, ...]:
        """The links that are angles of directions: what may turn."""
        names = {
            n for equation in self._equations for n in _in_directions(equation.tree)
        }
        return tuple(n for n, x in self.links.items() if n in names and x.unit == "rad")

    def vectors(self, algebra: Any) -> dict[str, list[tuple[str, Array]]]:
        """Return the vectors of each loop, in their order, of a solved algebra.

        Each with the text of its length: float64[2, trial], SI.
        """
        by_loop = dict[str, list[tuple[str, Array]]]()
        equations = iter(self._equations)
        for name, along, across in zip(self._loops, equations, equations, strict=True):
            both = zip(_terms(along.tree), _terms(across.tree), strict=True)
            by_loop[name] = [
                (ast.unparse(node), sign * np.array([
                    along.worked_out(algebra, first).value,
                    across.worked_out(algebra, second).value,
                ]))
                for (sign, first, node), (_, second, _) in both
            ]  # fmt: skip
        return by_loop

    def solved(self, algebra: Any) -> Any:
        """Return an algebra that has the unknowns, too; NaN where loops stay open."""
        if isinstance(algebra, Dimensions):
            return replace(algebra, units={**algebra.units, **self.units})
        if all(name in algebra.solved for name in self.unknowns):
            return algebra
        solution, shape = self._solution(algebra.links)
        sizes, of_equations = self._sizes
        values = np.where(solution.closes, sizes[:, None] * solution.unknowns, np.nan)
        values = values.reshape(-1, *shape)
        constants = map(algebra.constant, values)
        fixed = dict(zip(self.unknowns, constants, strict=True))
        residuals = [
            e.worked_out(replace(algebra, solved=fixed)) for e in self._equations
        ]
        slopes = -sizes[:, None] * solution.inverse / of_equations
        by_residual = np.moveaxis(slopes, 0, 2).reshape(*slopes.shape[1:], *shape)
        unknowns = {
            name: algebra.implicit(value, [*zip(parts, residuals, strict=True)])
            for name, value, parts in zip(
                self.unknowns, values, by_residual, strict=True
            )
        }
        return replace(algebra, solved={**algebra.solved, **unknowns})


def _names(tree: ast.AST) -> set[str]:
    return {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}


def _in_directions(tree: ast.AST) -> set[str]:
    """Return the names after an @ of a loop."""
    named = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.MatMult):
            named |= _names(node.right)
    return named


def _terms(
    tree: ast.expr, sign: float = 1.0
) -> Iterator[tuple[float, ast.expr, ast.expr]]:
    """Yield the sign, the vector and the length of each term of a loop."""
    match tree:
        case ast.BinOp(left=left, op=ast.Add() | ast.Sub() as op, right=right):
            yield from _terms(left, sign)
            yield from _terms(right, -sign if isinstance(op, ast.Sub) else sign)
        case ast.UnaryOp(op=op, operand=operand):
            yield from _terms(operand, -sign if isinstance(op, ast.USub) else sign)
        case ast.BinOp(left=length):
            yield sign, tree, length
