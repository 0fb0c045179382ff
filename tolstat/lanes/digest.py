"""What identifies a computation: the code that computes it, and nothing else.

Every name is followed from the roots to its definition, through the imports within
tolstat, within the package of a file and within its folder. The digest is of the syntax
trees that are reached. A name stands for its definition: files and functions may be
moved and renamed. What lies outside counts by its name; its version is stored with a
run.

These do not count: comments, docstrings, annotations, positions, the arguments of
`raise` and of warnings, the labels of what a model declares, and what it only shows.

Functions that register with Numba have no name that others use. They count in every
file that is entered, as do statements that are carried out when a file is loaded.
Code that is imported by a text is not seen, and neither is a file of data.
"""

from __future__ import annotations

import ast
import hashlib
import sysconfig
from collections.abc import Iterable, Iterator
from functools import cache
from itertools import zip_longest
from pathlib import Path
from typing import Any, NamedTuple

PACKAGE = Path(__file__).parents[1]
# what keeps compiled code decides no number
OPAQUE = ("lanes/digest.py", "lanes/cache.py")
INSTALLED = {Path(sysconfig.get_path(each)) for each in ("purelib", "platlib")}

# what a model declares: it counts by what is given, but for the labels
DECLARED = {"Contributor", "Response", "StudyNumber", "setting", "column"}
LABELS = {"symbol", "sentence", "source", "shown", "part", "caveat"}
# members of a model, a class with both of these, that no trial needs
MODEL = {"describe", "evaluate"}
SHOWN = {
    "name", "title", "assumptions", "failures", "views",
    "history", "numbers", "moves", "source_digest",
}  # fmt: skip
# annotations, and what is not alike in all versions of Python
SKIPPED = {"annotation", "returns", "ctx", "kind", "type_comment", "type_params"}
DEFINITIONS = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)
IMPORTS = (ast.Import, ast.ImportFrom)


class Place(NamedTuple):
    """A definition at the outermost level of a file; the whole file without such."""

    path: Path
    name: str = ""


class _Import(NamedTuple):
    """What a file gets from others: a module, or a name in it."""

    module: str
    level: int = 0
    name: str = ""


class _Module(NamedTuple):
    """A file, parsed."""

    path: Path
    defined: dict[str, list[ast.stmt]]  # what binds or changes a name; effects too
    imported: dict[str, _Import]
    effects: list[str]


@cache
def digest(*roots: Place | str) -> str:
    """Digest what computes the roots.

    Parameters
    ----------
    *roots : Place or str
        Definitions and files; a text counts as it is.

    Returns
    -------
    str
        16 hexadecimal digits, the same on all computers.
    """
    wanted, entered, found = [*roots], set[Path](), set[str]()
    while wanted:
        reached, text = _reached(wanted.pop())
        found.add(hashlib.sha256(text.encode()).hexdigest())
        for path in _with_loaded({place.path for place in reached}) - entered:
            entered.add(path)
            wanted += [Place(path, name) for name in _module(path).effects]
    return hashlib.sha256(" ".join(sorted(found)).encode()).hexdigest()[:16]


def forget() -> None:
    """Read all files again: they may have changed."""
    for each in (digest, _module, _found, _written):
        each.cache_clear()


def _reached(root: Place | str) -> tuple[list[Place], str]:
    """Return what a root reaches, and its text: definitions go by their turn."""
    if isinstance(root, str):
        return [], root
    text, turns, places = list[str](), {root: 0}, [root]
    for place in places:
        for part in _written(place):
            if isinstance(part, Place):
                if part not in turns:
                    turns[part] = len(turns)
                    places.append(part)
                part = f"@{turns[part]}"
            text.append(part)
        text.append(";")
    return places, " ".join(text)


def _with_loaded(paths: Iterable[Path]) -> set[Path]:
    """Add the files that these import as modules."""
    found, wanted = set[Path](), [*paths]
    while wanted:
        path = wanted.pop()
        if path not in found and not _opaque(path):
            found.add(path)
            targets = [_found(t, path) for t in _module(path).imported.values()]
            wanted += [t.path for t in targets if isinstance(t, Place) and not t.name]
    return found


def _opaque(path: Path) -> bool:
    return path in {PACKAGE / each for each in OPAQUE}


@cache
def _module(path: Path) -> _Module:
    """Parse a file."""
    module = _Module(path, {}, {}, [])
    for statement in ast.parse(path.read_bytes()).body:
        if not isinstance(statement, DEFINITIONS):
            module.imported.update(_imports(statement))
        if not (isinstance(statement, IMPORTS) or _only_said(statement)):
            names = [name for name in _bound(statement) if name not in module.imported]
            if not names or _registers(statement, module):
                names.append(f"effect {len(module.effects)}")
                module.effects.append(names[-1])
            for name in names:
                module.defined.setdefault(name, []).append(statement)
    return module


def _only_said(node: ast.AST) -> bool:
    """Tell docstrings, and what is imported for annotations."""
    if isinstance(node, ast.If):
        return "TYPE_CHECKING" in ast.dump(node.test)
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)


def _bound(statement: ast.stmt) -> list[str]:
    """Return the names that a statement binds or changes."""
    if isinstance(statement, DEFINITIONS):
        return [statement.name]
    nodes, found = [*ast.walk(statement)], []
    inner = [n.target for n in nodes if isinstance(n, ast.comprehension)]
    within = {id(n) for target in inner for n in ast.walk(target)}
    for node in nodes:
        if isinstance(node, DEFINITIONS):
            found.append(node.name)
        elif id(node) not in within and isinstance(
            getattr(node, "ctx", None), ast.Store | ast.Del
        ):
            while isinstance(node, ast.Subscript | ast.Attribute):
                node = node.value
            found += [node.id] if isinstance(node, ast.Name) else []
    return found


def _registers(statement: ast.stmt, module: _Module) -> bool:
    """Tell functions and classes that Numba decorates."""
    decorators = statement.decorator_list if isinstance(statement, DEFINITIONS) else []
    of = (_target(d.func if isinstance(d, ast.Call) else d, module) for d in decorators)
    return any(isinstance(t, str) and t.startswith("numba.") for t in of)


def _imports(tree: ast.AST) -> Iterator[tuple[str, _Import]]:
    """Yield what a tree imports, by the names that it gets there."""
    for node in ast.walk(tree):
        for each in node.names if isinstance(node, IMPORTS) else ():
            if isinstance(node, ast.ImportFrom):
                known = _Import(node.module or "", node.level, each.name)
                yield each.asname or each.name, known
            else:
                name = each.name if each.asname else each.name.partition(".")[0]
                yield each.asname or name, _Import(name)


@cache
def _found(what: _Import, path: Path) -> Place | str:
    """Find what a file imports; what lies outside by its dotted name."""
    home = _file_of(what.module, path, what.level)
    if home and what.name:
        return _member(home, what.name)
    return home or ".".join(filter(None, (what.module, what.name)))


def _file_of(dotted: str, path: Path, level: int = 0) -> Place | None:
    """Find the file of a module that a file imports; None if it lies outside."""
    parts = dotted.split(".") if dotted else []
    if level:
        homes = [path.parents[level - 1]]
    elif parts[0] == PACKAGE.name:
        homes = [PACKAGE.parent]
    elif path.is_relative_to(PACKAGE):
        homes = []
    else:
        top = path.parent
        while (top / "__init__.py").exists():
            top = top.parent
        homes = [top] if parts[0] in path.relative_to(top).parts else []
        homes += [path.parent] if path.parent not in INSTALLED else []
    for home in homes:
        file = home.joinpath(*parts)
        for found in (file / "__init__.py", file.with_name(f"{file.name}.py")):
            if found.is_file():
                return Place(found)
    return None


def _member(home: Place, name: str) -> Place | str:
    """Find what a module has by a name: where it is defined, or a module in it."""
    module = _module(home.path)
    if name in module.defined:
        return Place(home.path, name)
    if name in module.imported:
        return _found(module.imported[name], home.path)
    if "*" in module.imported:
        return _found(module.imported["*"]._replace(name=name), home.path)
    inner = _file_of(name, home.path, 1) if home.path.name == "__init__.py" else None
    return inner or name


def _target(node: ast.AST, module: _Module) -> Place | str | None:
    """Find what an expression names: a definition, a module, what lies outside."""
    if isinstance(node, ast.Name):
        if node.id in module.imported:
            return _found(module.imported[node.id], module.path)
        if node.id in module.defined:
            return Place(module.path, node.id)
        if "*" in module.imported:
            known = _found(module.imported["*"]._replace(name=node.id), module.path)
            return known if isinstance(known, Place) else None
    if isinstance(node, ast.Attribute):
        of = _target(node.value, module)
        if isinstance(of, str):
            return f"{of}.{node.attr}"
        return _member(of, node.attr) if of and not of.name else None
    return None


@cache
def _written(place: Place) -> list[Place | str]:
    """Write a definition, with the places of the definitions that it names."""
    text: list[Place | str] = []
    if _opaque(place.path):
        return text
    module = _module(place.path)
    if place.name not in module.defined:
        return [Place(place.path, name) for name in module.defined]
    for statement in module.defined[place.name]:
        inner = dict(_imports(statement))
        known = module._replace(imported={**module.imported, **inner})
        _write(statement, known, text, outermost=True)
    return text


def _write(
    node: Any, module: _Module, text: list[Place | str], *, outermost: bool = False
) -> None:
    """Write of a syntax tree what is computed."""
    if isinstance(node, list):
        text.append("[")
        for each in node:
            if not (isinstance(each, IMPORTS) or _only_said(each)):
                _write(each, module, text)
        text.append("]")
    elif not isinstance(node, ast.AST):
        text.append(repr(node))
    elif (target := _target(node, module)) is not None:
        text.append(target)
    elif isinstance(node, ast.AnnAssign):
        if node.value is not None:
            _write(ast.Assign([node.target], node.value), module, text)
    else:
        text.append(type(node).__name__)
        for field, value in _computed(node, module):
            if not (outermost and field == "name"):
                _write(value, module, text)


def _computed(node: ast.AST, module: _Module) -> Iterator[tuple[str, Any]]:
    """Yield the fields of a node that count."""
    fields = {name: getattr(node, name, None) for name in node._fields}
    match node:
        case ast.Raise():
            return
        case ast.Assert():
            del fields["msg"]
        case ast.Call(func=function, args=args, keywords=keywords):
            if _target(function, module) == "warnings.warn":
                return
            if declared := _declared(function, module):
                kind, order = declared
                given = zip_longest(args, order[: len(args)])
                fields["func"] = ast.Constant(kind)
                fields["args"] = [arg for arg, name in given if name not in LABELS]
                fields["keywords"] = [k for k in keywords if k.arg not in LABELS]
        case ast.ClassDef():
            fields["body"] = [
                # a field, other than a constant of the class
                ast.keyword(each.target.id, each.value or ast.Constant(...))
                if isinstance(each, ast.AnnAssign) and isinstance(each.target, ast.Name)
                else each
                for each in _needed(node)
            ]
    yield from ((name, value) for name, value in fields.items() if name not in SKIPPED)


def _needed(kind: ast.ClassDef) -> list[ast.stmt]:
    """List the members of a class; of a model those that a trial needs."""
    members = [(each, {*_bound(each)}) for each in kind.body]
    if not set[str]().union(*(names for _, names in members)) >= MODEL:
        return kind.body
    needed = [each for each, names in members if not names & SHOWN]
    for each in needed:  # grows
        used = {
            at.attr
            for at in ast.walk(each)
            if isinstance(at, ast.Attribute)
            and isinstance(at.value, ast.Name)
            and at.value.id == "self"
        }
        needed += [m for m, names in members if names & used and m not in needed]
    return needed


def _declared(function: ast.AST, module: _Module) -> tuple[str, list[str]] | None:
    """Return which declaration a call makes, and the order of its parameters."""
    target = _target(function, module)
    while isinstance(target, Place):
        of = _module(target.path)
        own = target.name in DECLARED and target.path.is_relative_to(PACKAGE)
        match of.defined.get(target.name):
            case [ast.Assign(value=value)]:  # a shorter name
                target = _target(value, of)
            case [ast.ClassDef() as kind] if own:
                return target.name, [
                    name for each in kind.body for name in _bound(each)
                ]
            case [ast.FunctionDef(args=args)] if own:
                return target.name, [each.arg for each in args.args]
            case _:
                return None
    return None
