"""The formula of a closing link: read as a tree of a few allowed nodes, never run."""

import ast
import keyword
import math
import re
import sys
import unicodedata
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol, cast

from tolstat.errors import ModelError, UnitError, allowed_names
from tolstat.machines.dimension_chain.algebras import (
    CHOICE,
    OF_ONE,
    Dimensions,
    Quantity,
    Values,
)
from tolstat.units.conversion import MEANINGS, known_name
from tolstat.units.typography import check_signs, typed_formula

LONGEST, SHOWN = 1000, 80  # characters
DEEPEST = 500  # nodes below each other
LARGEST = 10.0  # exponent
CONSTANTS = {"pi": math.pi}
FIT = "{0}_hole {0}_shaft"  # the links of a fit
Algebra = Values | Dimensions  # evaluates a formula
# each with the number of its arguments, at least and at most
FUNCTIONS = {
    **dict.fromkeys(OF_ONE, (1, 1)),
    "atan2": (2, 2), "hypot": (2, 3), "min": (2, 9), "max": (2, 9), "mod": (2, 2),
    CHOICE: (3, 3),
}  # fmt: skip
COMPARED = {ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">="}
_IF = re.compile(r"\bif(?=\s*\()")  # a keyword of Python
# a number and the word behind it, which is its unit, unless it is a link or a function
_QUANTITY = re.compile(
    r"(?<![\w.])((?>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?))"
    r"(\s*([A-Za-zµμ°Ω]+))(?![\w.])(?!\s*\()"
)
_COMMA = re.compile(r"(?<![\w.])\d+,\d+")  # perhaps a decimal sign
SIGNS = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.Pow: "**"}


class Unknowns(Protocol):
    """Names that stand for what vector loops determine."""

    @property
    def unknowns(self) -> tuple[str, ...]:
        """Their names."""
        ...

    @property
    def used(self) -> tuple[str, ...]:
        """The links that determine them."""
        ...

    def solved(self, algebra: Any) -> Any:
        """Return an algebra that has them, too."""
        ...


class Step(NamedTuple):
    """A step of a formula: its function or sign, and what it is of."""

    name: str
    node: ast.expr
    arguments: tuple[ast.expr, ...]

    def __str__(self) -> str:
        """Return its text."""
        return ast.unparse(self.node)


@dataclass(frozen=True)
class Formula:
    """A formula that was read and holds nothing but what is allowed."""

    text: str
    names: tuple[str, ...]  # of links that it may name
    gap: str = "gap"  # what it is the formula of
    # of other gaps that it may name, as what they stand for
    gaps: Mapping[str, ast.expr] = field(default_factory=dict, repr=False)
    loops: Unknowns | None = field(default=None, repr=False)  # whose unknowns it may
    # of a vector loop: cos for its equation along 0 deg, sin along 90 deg
    along: str = ""
    tree: ast.expr = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        """Read it once.

        Raises ModelError if it holds anything else; the message gives place, text and
        allowed words.
        """
        # lines may be broken for the eye
        text = typed_formula(" ".join(self.text.split()))
        object.__setattr__(self, "text", text)
        object.__setattr__(self, "tree", self._parsed())
        values = Values(dict.fromkeys(self._all_names, math.nan))
        self._value(self.tree, values)  # as it is walked
        if self.along:
            self._check_directions(self.tree)
        if not self.used:
            raise ModelError(f"{self.gap} = {self._quoted} names no link")

    @property
    def used(self) -> tuple[str, ...]:
        """The links that it depends on, in their order."""
        named = {n.id for n in ast.walk(self.tree) if isinstance(n, ast.Name)}
        if self.loops and named & {*self.loops.unknowns}:
            named |= {*self.loops.used}
        return tuple(name for name in self.names if name in named)

    @property
    def _all_names(self) -> tuple[str, ...]:
        """The links and the unknowns."""
        return *self.names, *(self.loops.unknowns if self.loops else ())

    @property
    def _quoted(self) -> str:
        """The text for a message."""
        return repr(self.text if len(self.text) <= SHOWN else f"{self.text[:SHOWN]}...")

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """Its numbers that have a unit."""
        values = (getattr(node, "value", None) for node in ast.walk(self.tree))
        return tuple(value for value in values if isinstance(value, Quantity))

    @property
    def steps(self) -> tuple[Step, ...]:
        """Its divisions, powers and calls of functions."""
        steps = []
        for node in ast.walk(self.tree):
            match node:
                case ast.Call(func=ast.Name(id=name), args=arguments):
                    steps.append(Step(name, node, tuple(arguments)))
                case ast.BinOp(left=left, op=ast.Div() | ast.Pow() as op, right=right):
                    steps.append(Step(SIGNS[type(op)], node, (left, right)))
        return tuple(steps)

    def worked_out(self, algebra: Algebra, part: ast.expr | None = None) -> Any:
        """Return the value of the formula, or of a part: numbers, slopes or dimensions.

        Raises ModelError if the algebra refuses a step (`ValueError`): its place and
        the reason.
        """
        if self.loops:
            algebra = self.loops.solved(algebra)
        return self._value(part or self.tree, algebra)

    def _value(self, node: ast.expr, algebra: Algebra, depth: int = 0) -> Any:
        """Return the value of a node and the nodes below it; refuse any not allowed."""
        if depth > DEEPEST:
            raise self._refused(node, f"more than {DEEPEST} nested operations")
        below = depth + 1
        match node:
            case ast.Constant(value=bool() | str() | bytes() | complex() | None):
                raise self._refused(node, f"{node.value!r} is not a number")
            case ast.Constant(value=int() | float() as value):
                if not abs(value) <= sys.float_info.max:
                    raise self._refused(node, "the number is too large")
                typed = isinstance(value, Quantity)
                return algebra.constant(value if typed else float(value))
            case ast.Name(id=name) if name in self._all_names:
                return algebra.link(name)
            case ast.Name(id=name):
                if name not in CONSTANTS:
                    raise self._unknown(node, name)
                return algebra.constant(CONSTANTS[name])
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                negative = algebra.constant(-1.0)
                inner = self._value(operand, algebra, below)
                return self._step(node, algebra.operation, "*", negative, inner)
            case ast.UnaryOp(op=ast.UAdd(), operand=operand):
                return self._value(operand, algebra, below)
            case ast.BinOp(
                left=ast.Constant(value=Quantity()) as left, op=ast.Pow()
            ) if (
                node.col_offset == left.col_offset  # no parenthesis
            ):
                reason = (
                    f"write ({left.value!r})**..., or make {left.value!r}**... a link"
                )
                raise self._refused(node, reason)
            case ast.BinOp(left=left, op=ast.Pow(), right=right):
                base, exponent = self._value(left, algebra, below), _exponent(right)
                if exponent is None and not _is_number(right):
                    both = [base, self._value(right, algebra, below)]
                    return self._step(right, algebra.function, "power", both)
                if exponent is None:
                    reason = f"a plain number from -{LARGEST:g} to {LARGEST:g}"
                    raise self._refused(right, f"an exponent is {reason}")
                return self._step(right, algebra.operation, "**", base, exponent)
            case ast.BinOp(
                left=ast.BinOp(op=ast.Pow(), right=ast.Constant(value=1)), op=ast.Div()
            ):
                reason = "**1/2 is half of the number; write sqrt(...) or **0.5"
                raise self._refused(node, reason)
            case ast.BinOp(left=left, op=op, right=right) if type(op) in SIGNS:
                first = self._value(left, algebra, below)
                second = self._value(right, algebra, below)
                sign = SIGNS[type(op)]
                return self._step(right, algebra.operation, sign, first, second)
            case ast.BinOp(left=left, op=ast.MatMult(), right=right) if self.along:
                length = self._value(left, algebra, below)
                angle = self._value(right, algebra, below)
                part = self._step(right, algebra.function, self.along, [angle])
                return self._step(left, algebra.operation, "*", length, part)
            case ast.BinOp(op=ast.MatMult()):
                reason = "a direction after @ stands in [loops]"
                raise self._refused(node, f"{reason}, not in a gap")
            case ast.BinOp(op=ast.BitXor()):
                raise self._refused(node, "a power is written **, not ^")
            case ast.Call(args=args):
                name = self._function(node)
                if name == CHOICE:
                    return self._chosen(node, args, algebra, below)
                arguments = [self._value(argument, algebra, below) for argument in args]
                return self._step(node, algebra.function, name, arguments)
        if isinstance(node, ast.Tuple):
            raise self._refused(node, "a comma outside a function")
        allowed = "links, numbers, + - * / ** and functions are allowed"
        raise self._refused(node, f"{allowed} ({', '.join(FUNCTIONS)})")

    def _check_directions(self, node: ast.expr) -> None:
        """Refuse a term of a loop that has no direction, or two."""
        match node:
            case ast.BinOp(left=left, op=ast.Add() | ast.Sub(), right=right):
                self._check_directions(left)
                self._check_directions(right)
            case ast.UnaryOp(operand=operand):
                self._check_directions(operand)
            case ast.BinOp(left=left, op=ast.MatMult(), right=right):
                for part in (*ast.walk(left), *ast.walk(right)):
                    if isinstance(part, ast.MatMult):
                        raise self._refused(node, "a vector has one direction")
            case _:
                raise self._refused(
                    node,
                    "a term of a loop is a length and its direction, such as rod @ "
                    "theta; a sum of angles stands in parentheses",
                )

    def _chosen(
        self, node: ast.Call, args: Sequence[ast.expr], algebra: Algebra, depth: int
    ) -> Any:
        """Return the value of a choice by a comparison."""
        match args[0]:
            case ast.Compare(left=left, ops=[op], comparators=[right]) if (
                type(op) in COMPARED
            ):
                sides = [self._value(side, algebra, depth) for side in (left, right)]
            case _:
                reason = f"a comparison is expected, with {' '.join(COMPARED.values())}"
                raise self._refused(args[0], reason)
        condition = self._step(args[0], algebra.function, COMPARED[type(op)], sides)
        if (
            isinstance(algebra, Values) and algebra.strict
        ):  # the other may have no value
            return self._value(args[1 if condition else 2], algebra, depth)
        choices = [self._value(choice, algebra, depth) for choice in args[1:]]
        return self._step(node, algebra.function, CHOICE, [condition, *choices])

    def _step(self, node: ast.expr, rule: Any, *parts: Any) -> Any:
        try:
            return rule(*parts)
        except ValueError as error:
            raise self._refused(node, str(error)) from None

    def _parsed(self) -> ast.expr:
        if len(self.text) > LONGEST:
            raise ModelError(
                f"the formula has {len(self.text)} characters; at most {LONGEST} fit"
            )
        for name in self.names:
            plain = unicodedata.normalize("NFKC", name)
            if keyword.iskeyword(name) or not name.isidentifier() or name != plain:
                raise ModelError(
                    f"a link cannot be called '{name}': letters, digits and _ are "
                    "allowed, a letter first, and no keyword of Python"
                )
        if not self.text:
            raise ModelError(
                f"{self.gap} is empty: a formula is expected, such as 'A - 2*B'"
            )
        if "#" in self.text:  # what follows it would be left out
            character = self.text.index("#") + 1
            raise ModelError(
                f"{self.gap} = {self._quoted}, character {character}: a formula has "
                "no comments"
            )
        for i, sign in enumerate(self.text, start=1):
            try:
                check_signs(
                    sign, "of a formula", letters=sign * f"a{sign}".isidentifier()
                )
            except UnitError as error:
                place = f"{self.gap} = {self._quoted}, character {i}"
                raise ModelError(f"{place}: {error}") from None
        if comma := _COMMA.search(self.text):
            two = comma[0].replace(",", ", ")
            raise ModelError(
                f"{self.gap} = {self._quoted}, character {comma.start() + 1}, "
                f"'{comma[0]}': one number or two; write {comma[0].replace(',', '.')} "
                f"or, for two values, {two}"
            )
        text, units = typed_units(_IF.sub(CHOICE, self.text), self._all_names)
        try:
            tree = ast.parse(text, mode="eval")
            for node in ast.walk(tree):
                if isinstance(node, ast.Constant) and node.col_offset in units:
                    number, unit = cast(float, node.value), units[node.col_offset]
                    node.value = self._step(node, Quantity, number, unit)
            return _Gaps(self.gaps).visit(tree).body  # type: ignore[no-any-return]
        except SyntaxError as error:
            character = error.offset or len(self.text)
            raise ModelError(
                f"{self.gap} = {self._quoted} cannot be read at character {character}; "
                "a formula such as 'A - 2*B' is expected, with a sign between all "
                "parts and commas between the values of a function"
            ) from None
        except ModelError:
            raise
        except (RecursionError, MemoryError, ValueError):
            raise ModelError("the formula is too deeply nested to be read") from None

    def _unknown(self, node: ast.expr, name: str) -> ModelError:
        if name in FUNCTIONS:
            return self._refused(node, f"{name} is a function; write {name}(...)")
        if fit := [link for link in self.names if link in FIT.format(name).split()]:
            return self._refused(node, f"{name} is a fit; write {' or '.join(fit)}")
        if name == "π":
            return self._refused(node, "write pi")
        if known_name(name) in MEANINGS:
            reason = "is a unit: a number with a unit of several parts is a link"
            return self._refused(node, f"{name} {reason}")
        numbered = re.compile(rf"{re.escape(name)}_\d+")
        if alike := [link for link in self.names if numbered.fullmatch(link)]:
            terms = alike if len(alike) < 3 else [alike[0], "...", alike[-1]]
            reason = f"[links] has no {name}; write {' + '.join(terms)}"
            return self._refused(node, reason)
        allowed = allowed_names(name, [*self._all_names, *self.gaps, *CONSTANTS])
        return self._refused(node, f"[links] has no {name}; {allowed}")

    def _function(self, node: ast.Call) -> str:
        """Return the function that is called; refuse another, and wrong arguments."""
        if not isinstance(node.func, ast.Name) or node.func.id not in FUNCTIONS:
            called = ast.unparse(node.func)[:40]
            allowed = allowed_names(called, [*FUNCTIONS, "**"])
            raise self._refused(node, f"{called} is not a function here; {allowed}")
        least, most = FUNCTIONS[node.func.id]
        starred = any(isinstance(argument, ast.Starred) for argument in node.args)
        if node.keywords or starred or not least <= len(node.args) <= most:
            count = f"{least}" if least == most else f"{least} to {most}"
            words = "value" if count == "1" else "values"
            raise self._refused(node, f"{node.func.id} takes {count} {words}")
        return node.func.id

    def _refused(self, node: ast.expr, reason: str) -> ModelError:
        """Return an error with the place in the formula, its text, and the reason."""
        start = len(self.text.encode()[: node.col_offset].decode(errors="ignore"))
        stop = len(self.text.encode()[: node.end_col_offset].decode(errors="ignore"))
        excerpt = self.text[start:stop][:40]
        where = f"{self.gap} = {self._quoted}, character {start + 1}, {excerpt!r}"
        error = ModelError(f"{where}: {reason}")
        error.link = node.id if isinstance(node, ast.Name) else ""
        return error


class _Gaps(ast.NodeTransformer):
    """Puts the formulas of gaps in the place of their names."""

    def __init__(self, gaps: Mapping[str, ast.expr]) -> None:
        self._gaps = gaps

    def visit_Name(self, node: ast.Name) -> ast.expr:
        """Return the formula of a gap; any other name as it is."""
        return self._gaps.get(node.id, node)


def typed_units(text: str, names: Collection[str]) -> tuple[str, dict[int, str]]:
    """Return a formula without the units of its numbers, and these by their place.

    A word that is among the names is no unit.
    """
    units: dict[int, str] = {}

    def without_unit(match: re.Match[str]) -> str:
        if match[3] in names:
            return match[0]
        units[len(text[: match.start()].encode())] = match[3]
        return match[1] + " " * len(match[2].encode())

    return _QUANTITY.sub(without_unit, text), units


def _is_number(node: ast.expr) -> bool:
    """Tell a number as typed, with its sign, from what holds a link."""
    return not any(isinstance(part, ast.Name) for part in ast.walk(node))


def _exponent(node: ast.expr) -> float | None:
    """Return a plain number that is not too large; None for anything else."""
    try:
        value = ast.literal_eval(node)
    except ValueError:
        return None
    plain = isinstance(value, int | float) and not isinstance(value, bool | Quantity)
    return float(value) if plain and abs(value) <= LARGEST else None
