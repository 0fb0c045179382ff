"""The formula of a closing link: read as a tree of a few allowed nodes, never run."""

from __future__ import annotations

import ast
import keyword
import math
import unicodedata
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

from tolstat.errors import ModelError, allowed_names

LONGEST, SHOWN = 1000, 80  # characters
DEEPEST = 500  # nodes below each other
LARGEST = 10.0  # exponent
CONSTANTS = {"pi": math.pi}
# each with the number of its arguments, at least and at most
FUNCTIONS = {
    "sqrt": (1, 1), "abs": (1, 1), "exp": (1, 1), "log": (1, 1),
    "sin": (1, 1), "cos": (1, 1), "tan": (1, 1),
    "asin": (1, 1), "acos": (1, 1), "atan": (1, 1), "atan2": (2, 2),
    "hypot": (2, 3), "min": (2, 9), "max": (2, 9),
}  # fmt: skip
SIGNS = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.Pow: "**"}


class Algebra(Protocol):
    """What a formula is worked out in: numbers, slopes, dimensions."""

    def constant(self, value: float) -> Any:
        """Return a number of the formula."""

    def link(self, name: str) -> Any:
        """Return a link."""

    def operation(self, sign: str, left: Any, right: Any) -> Any:
        """Combine two by + - * / or **; an exponent is a plain float."""

    def function(self, name: str, arguments: Sequence[Any]) -> Any:
        """Apply a function of `FUNCTIONS`."""


@dataclass(frozen=True)
class Formula:
    """A formula that was read and holds nothing but what is allowed.

    Attributes
    ----------
    text : str
        As it was written.
    names : tuple of str
        Links that it may name.
    """

    text: str
    names: tuple[str, ...]
    _tree: ast.expr = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        """Read it once.

        Raises
        ------
        ModelError
            If it holds anything else: the place, what stands there, what is allowed.
        """
        object.__setattr__(self, "_tree", self._parsed())
        self._check(self._tree, 0)
        if not self.used:
            raise ModelError(f"gap = {self._shown} names no link")

    @property
    def used(self) -> tuple[str, ...]:
        """The links that it names, in their order."""
        named = {n.id for n in ast.walk(self._tree) if isinstance(n, ast.Name)}
        return tuple(name for name in self.names if name in named)

    @property
    def _shown(self) -> str:
        """The text for a message."""
        return repr(self.text if len(self.text) <= SHOWN else f"{self.text[:SHOWN]}...")

    def worked_out(self, algebra: Algebra) -> Any:
        """Work the formula out in numbers, slopes or dimensions.

        Parameters
        ----------
        algebra : Algebra
            What its links are.

        Raises
        ------
        ModelError
            If the algebra refuses a step (`ValueError`): its place and the reason.
        """
        return self._value(self._tree, algebra)

    def _value(self, node: ast.expr, algebra: Algebra) -> Any:
        match node:
            case ast.Constant(value=int() | float() as value):
                return algebra.constant(float(value))
            case ast.Name(id=name) if name in CONSTANTS and name not in self.names:
                return algebra.constant(CONSTANTS[name])
            case ast.Name(id=name):
                return algebra.link(name)
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                parts = (algebra.constant(-1.0), self._value(operand, algebra))
                return self._step(node, algebra.operation, "*", *parts)
            case ast.UnaryOp(operand=operand):
                return self._value(operand, algebra)
            case ast.BinOp(left=left, op=ast.Pow(), right=right):
                base = self._value(left, algebra)
                exponent = _exponent(right)
                return self._step(right, algebra.operation, "**", base, exponent)
            case ast.BinOp(left=left, op=op, right=right):
                sides = self._value(left, algebra), self._value(right, algebra)
                return self._step(right, algebra.operation, SIGNS[type(op)], *sides)
            case ast.Call(func=ast.Name(id=name), args=args):
                arguments = [self._value(each, algebra) for each in args]
                return self._step(node, algebra.function, name, arguments)
        raise AssertionError("the formula was checked")

    def _step(self, node: ast.expr, rule: Any, *parts: Any) -> Any:
        try:
            return rule(*parts)
        except ValueError as error:
            raise self._refused(node, str(error)) from None

    def _parsed(self) -> ast.expr:
        if len(self.text) > LONGEST:
            raise ModelError(
                f"the formula has {len(self.text)} characters; up to {LONGEST} are read"
            )
        for name in self.names:
            plain = unicodedata.normalize("NFKC", name)
            if keyword.iskeyword(name) or not name.isidentifier() or name != plain:
                raise ModelError(
                    f"a link cannot be called '{name}': letters, digits and _ are "
                    "allowed, a letter first, and no word of a program"
                )
        if not self.text.strip():
            raise ModelError("gap is empty: a formula is expected, such as 'A - 2*B'")
        if "#" in self.text:  # what follows it would be left out
            place = self.text.index("#") + 1
            raise ModelError(
                f"gap = {self._shown}, character {place}: no remark stands in a formula"
            )
        # lines that were broken for the eye; places stay where they are
        text = "".join(" " if c in "\r\n\t" else c for c in self.text)
        lead = len(text) - len(text.lstrip(" "))
        try:
            tree = ast.parse(text[lead:], mode="eval").body
        except SyntaxError as error:
            place = lead + error.offset if error.offset else len(text)
            raise ModelError(
                f"gap = {self._shown} cannot be read at character {place}; a formula "
                "such as 'A - 2*B' is expected"
            ) from None
        except (RecursionError, MemoryError, ValueError):
            raise ModelError("the formula cannot be read: it is too deep") from None
        for node in ast.walk(tree):
            if isinstance(node, ast.expr):
                node.col_offset += lead
                node.end_col_offset = (node.end_col_offset or 0) + lead
        return tree

    def _check(self, node: ast.expr, depth: int) -> None:
        """Refuse what is not allowed, the place first."""
        if depth > DEEPEST:
            raise self._refused(node, f"more than {DEEPEST} steps inside each other")
        match node:
            case ast.Constant(value=bool() | str() | bytes() | complex() | None):
                raise self._refused(node, f"{node.value!r} is no number")
            case ast.Constant(value=int() | float() as value):
                if not _finite(value):
                    raise self._refused(node, "the number is too large")
            case ast.Name(id=name):
                self._check_name(node, name)
            case ast.UnaryOp(op=ast.USub() | ast.UAdd(), operand=operand):
                self._check(operand, depth + 1)
            case ast.BinOp(left=left, op=ast.Pow(), right=right):
                self._check(left, depth + 1)
                self._check_exponent(right)
            case ast.BinOp(left=left, op=op, right=right) if type(op) in SIGNS:
                self._check(left, depth + 1)
                self._check(right, depth + 1)
            case ast.BinOp(op=ast.BitXor()):
                raise self._refused(node, "a power is written **, not ^")
            case ast.Call():
                self._check_call(node, depth)
            case _:
                raise self._refused(
                    node,
                    "links, numbers, + - * / ** and functions are allowed "
                    f"({', '.join(FUNCTIONS)})",
                )

    def _check_name(self, node: ast.expr, name: str) -> None:
        if name in self.names or name in CONSTANTS:
            return
        if name in FUNCTIONS:
            raise self._refused(node, f"{name} is a function; write {name}(...)")
        known = [*self.names, *CONSTANTS]
        allowed = allowed_names(name, known)
        raise self._refused(node, f"[links] has no {name}; {allowed}")

    def _check_call(self, node: ast.Call, depth: int) -> None:
        if not isinstance(node.func, ast.Name) or node.func.id not in FUNCTIONS:
            called = ast.unparse(node.func)[:40]
            allowed = allowed_names(called, FUNCTIONS)
            raise self._refused(node, f"{called} is no function here; {allowed}")
        least, most = FUNCTIONS[node.func.id]
        starred = any(isinstance(each, ast.Starred) for each in node.args)
        if node.keywords or starred or not least <= len(node.args) <= most:
            count = f"{least}" if least == most else f"{least} to {most}"
            words = "value" if count == "1" else "values"
            raise self._refused(node, f"{node.func.id} takes {count} {words}")
        for each in node.args:
            self._check(each, depth + 1)

    def _check_exponent(self, node: ast.expr) -> None:
        if (exponent := _exponent(node)) is None or not abs(exponent) <= LARGEST:
            raise self._refused(
                node, f"an exponent is a plain number from -{LARGEST:g} to {LARGEST:g}"
            )

    def _refused(self, node: ast.expr, reason: str) -> ModelError:
        """Say where in the formula, what stands there, and what is wrong with it."""
        start = len(self.text.encode()[: node.col_offset].decode(errors="ignore"))
        stop = len(self.text.encode()[: node.end_col_offset].decode(errors="ignore"))
        here = self.text[start:stop][:40]
        where = f"gap = {self._shown}, character {start + 1}, {here!r}"
        return ModelError(f"{where}: {reason}")


def _exponent(node: ast.expr) -> Any:
    """Return a plain number with its sign; None for anything else."""
    match node:
        case ast.UnaryOp(op=ast.USub(), operand=ast.Constant() as inner):
            inside = _exponent(inner)
            return None if inside is None else -inside
        case ast.Constant(value=bool()):
            return None
        case ast.Constant(value=int() | float() as value) if _finite(value):
            return float(value)
    return None


def _finite(value: float) -> bool:
    try:
        return math.isfinite(float(value))
    except OverflowError:
        return False
