"""Digest of a computation: of the code that computes it, and of nothing else.

Every name is followed from the roots to its definition, through the imports within
tolstat, within the package of a file and within its folder. The digest is of the syntax
trees that are reached. A name stands for its definition: files and functions may be
moved and renamed. External code counts by its name; a run stores its version.

These do not count: comments, docstrings, annotations, positions, the arguments of
`raise` and of warnings, the labels of a model's declarations, and its display members.

Functions that register with Numba are not referred to by name. They count in every file
that is reached, and so do statements that are executed when a file is loaded. Code that
is imported by a text is not detected, and neither is a data file.
"""

import ast
import hashlib
import sysconfig
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

PACKAGE = Path(__file__).parents[1]
# the cache of compiled code affects no number
OPAQUE = ("lanes/digest.py", "lanes/cache.py")
INSTALLED = {Path(sysconfig.get_path(each)) for each in ("purelib", "platlib")}

# declarations of a model, and how many of their first arguments count although they are
# texts; other arguments count, except labels
DECLARED = {"Contributor": 2, "Response": 2, "setting": 1, "column": 0}
LABELS = {"symbol", "sentence", "source", "shown", "part", "caveat"}
# a class with both of these is a model; no trial needs the members in SHOWN
MODEL = {"describe", "evaluate"}
SHOWN = {
    "name", "title", "assumptions", "failures", "views",
    "history", "numbers", "moves", "source_digest",
}  # fmt: skip
# annotations, messages, and fields that differ between versions of Python
SKIPPED = {
    "annotation", "returns", "exc", "cause", "msg",
    "ctx", "kind", "type_comment", "type_params",
}  # fmt: skip
DEFINITIONS = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)
IMPORTS = (ast.Import, ast.ImportFrom)
EFFECT = "effect of"  # and the number of a statement that binds no name


class Place(NamedTuple):
    """A name in a file; the whole file without one."""

    path: Path
    name: str = ""


class _Module(NamedTuple):
    """A file, parsed."""

    path: Path
    defined: dict[str, list[ast.stmt]]  # by name that they bind or change; effects
    imported: dict[str, Place | str]


@cache
def digest(*roots: Place | str) -> str:
    """Return the digest of the code that computes the roots.

    Parameters
    ----------
    *roots : Place or str
        Definitions and files; a text counts literally.

    Returns
    -------
    str
        16 hexadecimal digits, the same on all computers.
    """
    wanted, entered, found = [*roots], set[Path](), set[str]()
    while wanted:
        places, text = _reached(wanted.pop())
        found.add(hashlib.sha256(text.encode()).hexdigest())
        paths = [place.path for place in places]
        for path in paths:  # grows by imported modules
            if path not in entered:
                entered.add(path)
                wanted += _effects(path)
                loaded = map(_definition, _module(path).imported.values())
                paths += [t.path for t in loaded if isinstance(t, Place) and not t.name]
    return hashlib.sha256(" ".join(sorted(found)).encode()).hexdigest()[:16]


def forget() -> None:
    """Forget all files: they may have changed."""
    for each in (digest, _module, _written):
        each.cache_clear()


def _reached(root: Place | str) -> tuple[list[Place], str]:
    """Return the places that a root reaches, and its text with numbered definitions."""
    if isinstance(root, str):
        return [], root
    text, turns, places = list[str](), {root: 0}, [root]
    for place in places:  # grows
        for part in _written(place):
            if isinstance(part, Place) and part not in turns:
                turns[part] = len(turns)
                places.append(part)
            text.append(f"@{turns[part]}" if isinstance(part, Place) else part)
        text.append(";")
    return places, " ".join(text)


@cache
def _module(path: Path) -> _Module:
    """Parse a file."""
    module = _Module(path, {}, {})
    opaque = path in (PACKAGE / each for each in OPAQUE)
    for statement in ast.parse(b"" if opaque else path.read_bytes()).body:
        names = _bound(statement)
        if isinstance(statement, DEFINITIONS):
            statement.name = ""  # it may be renamed
        else:
            module.imported.update(_imports(statement, path))
        for name in names or [f"{EFFECT} {len(module.defined)}"]:
            module.defined.setdefault(name, []).append(statement)
    return module


def _bound(statement: ast.stmt) -> list[str]:
    """Return the names that a definition or an assignment binds or changes."""
    match statement:
        case ast.FunctionDef(name) | ast.AsyncFunctionDef(name) | ast.ClassDef(name):
            return [name]
        case ast.Assign(targets):
            nodes = [node for each in targets for node in ast.walk(each)]
        case ast.AnnAssign(target) | ast.AugAssign(target):
            nodes = [*ast.walk(target)]
        case _:
            nodes = []
    return [node.id for node in nodes if isinstance(node, ast.Name)]


def _imports(tree: ast.AST, path: Path) -> dict[str, Place | str]:
    """Return the imports of a tree, by their names in it."""
    found: dict[str, Place | str] = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for each in node.names:
                name = each.name if each.asname else each.name.partition(".")[0]
                found[each.asname or name] = _file_of(name, path) or name
        elif isinstance(node, ast.ImportFrom):
            home = _file_of(node.module or "", path, node.level)
            names = {each.asname or each.name: each.name for each in node.names}
            if home and "*" in names:
                module = _module(home.path)
                names = {name: name for name in (*module.defined, *module.imported)}
            for own, name in names.items():
                found[own] = Place(home.path, name) if home else f"{node.module}.{name}"
    return found


def _effects(path: Path) -> list[Place]:
    """Return the nameless places of a file: effects, and functions for Numba."""
    module, found = _module(path), list[Place]()
    for name, statements in module.defined.items():
        decorators = [d for s in statements for d in getattr(s, "decorator_list", ())]
        of = [_target(getattr(each, "func", each), module) for each in decorators]
        numba = any(isinstance(each, str) and each.startswith("numba.") for each in of)
        found += [Place(path, name)] if numba or name.startswith(EFFECT) else []
    return found


def _file_of(dotted: str, path: Path, level: int = 0) -> Place | None:
    """Return the file of a module that a file imports; None if it is external."""
    parts = dotted.split(".") if dotted else []
    top = next(each for each in path.parents if not (each / "__init__.py").exists())
    if level:
        homes = [path.parents[level - 1]]
    elif parts[0] == PACKAGE.name:
        homes = [PACKAGE.parent]
    elif top in {PACKAGE.parent, *INSTALLED}:  # modules next to it are external
        homes = [top] if top / parts[0] in path.parents else []
    else:
        homes = [top, path.parent]
    files = [home.joinpath(*parts) for home in homes]
    found = [p for f in files for p in (f / "__init__.py", Path(f"{f}.py"))]
    return next((Place(each) for each in found if each.is_file()), None)


def _definition(of: Place | str) -> Place | str:
    """Return the definition of a name, through imports and aliases."""
    if isinstance(of, str) or not of.name:
        return of
    if of.name in DECLARED and of.path.is_relative_to(PACKAGE / "model"):
        return of.name
    module = _module(of.path)
    if of.name in module.imported:
        return _definition(module.imported[of.name])
    match module.defined.get(of.name):
        case None if of.path.name == "__init__.py":
            return _file_of(of.name, of.path, 1) or of
        case [ast.Assign([ast.Name()], ast.Name() | ast.Attribute() as longer)]:
            itself = ast.unparse(longer) == of.name  # a built-in name
            return of if itself else _target(longer, module) or of
    return of


def _target(node: ast.AST, module: _Module) -> Place | str | None:
    """Return the definition, module or external name that an expression names."""
    match node:
        case ast.Name(name) if name in module.imported:
            return _definition(module.imported[name])
        case ast.Name(name) if name in module.defined:
            return _definition(Place(module.path, name))
        case ast.Attribute(value, name):
            of = _target(value, module)
            if isinstance(of, str):
                return f"{of}.{name}"
            return _definition(Place(of.path, name)) if of and not of.name else None
    return None


@cache
def _written(place: Place) -> list[Place | str]:
    """Return the text of a definition, with the places of definitions it names."""
    module = _module(place.path)
    if place.name not in module.defined:
        return [Place(place.path, name) for name in module.defined]
    text: list[Place | str] = []
    for statement in module.defined[place.name]:
        inner = _imports(statement, place.path)
        known = module._replace(imported={**module.imported, **inner})
        text += _texts(statement, known)
    return text


def _texts(node: Any, module: _Module) -> Iterator[Place | str]:
    """Yield the computed parts of a syntax tree."""
    if isinstance(node, list):
        yield "["
        for each in node:
            yield from _texts(each, module)
        yield "]"
    elif not isinstance(node, ast.AST):
        yield repr(node)
    elif (target := _target(node, module)) is not None:
        yield target
    elif not (isinstance(node, IMPORTS) or _is_docstring(node)):
        yield type(node).__name__
        for each in _computed(node, module):
            yield from _texts(each, module)


def _computed(node: ast.AST, module: _Module) -> list[Any]:
    """Return the fields of a node that count."""
    fields = {n: getattr(node, n, None) for n in node._fields if n not in SKIPPED}
    if isinstance(node, ast.Call):
        function = _target(node.func, module)
        if function == "warnings.warn":
            return []
        if function in DECLARED:
            n = DECLARED[function]
            others = [each for each in node.args[n:] if not _is_text(each)]
            fields["args"] = node.args[:n] + others
            fields["keywords"] = [k for k in node.keywords if k.arg not in LABELS]
    elif isinstance(node, ast.ClassDef) and _is_model(node):
        text = ast.unparse(node)
        idle = {name for name in SHOWN if f"self.{name}" not in text}
        fields["body"] = [each for each in node.body if not idle & {*_bound(each)}]
    return [*fields.values()]


def _is_model(kind: ast.ClassDef) -> bool:
    return {name for each in kind.body for name in _bound(each)} >= MODEL


def _is_text(node: ast.AST) -> bool:
    text = isinstance(node, ast.Constant) and isinstance(node.value, str)
    return text or isinstance(node, ast.JoinedStr)


def _is_docstring(node: ast.AST) -> bool:
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
