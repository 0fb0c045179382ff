"""Digest of a computation: of its file and the files that this imports.

Imports are followed within tolstat, within the package of a file and within its folder.
Comments, docstrings and positions do not count. External code does not count either,
as a run stores its version. Code that is imported by a text is not detected, and
neither is a data file.
"""

import ast
import hashlib
import sysconfig
from functools import cache
from pathlib import Path

PACKAGE = Path(__file__).parents[1]
INSTALLED = {Path(sysconfig.get_path(name)) for name in ("purelib", "platlib")}
# fields that hold no code, or differ between versions of Python
SKIPPED = {"ctx", "kind", "type_comment", "type_params"}


@cache
def digest(*roots: Path | str) -> str:
    """Return the digest of the code of files and of all that they import.

    Parameters
    ----------
    *roots : Path or str
        Files; a text counts literally.

    Returns
    -------
    str
        16 hexadecimal digits, the same on all computers.
    """
    paths = [root for root in roots if isinstance(root, Path)]
    texts = [root for root in roots if isinstance(root, str)]
    for path in paths:  # grows
        code, imported = _parsed(path, path.read_bytes())
        texts.append(code)
        paths += [other for other in imported if other not in paths]
    hashes = sorted({hashlib.sha256(text.encode()).hexdigest() for text in texts})
    return hashlib.sha256(" ".join(hashes).encode()).hexdigest()[:16]


@cache
def _parsed(path: Path, content: bytes) -> tuple[str, list[Path]]:
    """Return the code of a file, and the files that it imports."""
    tree = ast.parse(content)
    code = list[str]()
    _append_code(tree, code)
    imported = set[Path | None]()
    for node in ast.walk(tree):
        match node:
            case ast.Import(names):
                imported |= {_file_of(alias.name, path) for alias in names}
            case ast.ImportFrom(module, names, level):
                home = f"{module}." if module else ""
                modules = {module or "", *(f"{home}{alias.name}" for alias in names)}
                imported |= {_file_of(name, path, level) for name in modules}
    # `tolstat` alone imports nothing: it loads its names when they are first used
    imported.discard(PACKAGE / "__init__.py")
    return " ".join(code), [file for file in imported if file]


def _append_code(node: object, code: list[str]) -> None:
    """Append the parts of a syntax tree; empty ones depend on Python's version."""
    if isinstance(node, list):
        code.append("[")
        for item in node:
            _append_code(item, code)
        code.append("]")
    elif not isinstance(node, ast.AST):
        code.append(repr(node))
    elif not (isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)):
        code.append(type(node).__name__)
        for field, value in ast.iter_fields(node):
            if field not in SKIPPED and value not in (None, []):
                code.append(field)
                _append_code(value, code)


def _file_of(dotted: str, path: Path, level: int = 0) -> Path | None:
    """Return the file of a module that a file imports; None if it is external."""
    parts = dotted.split(".") if dotted else []
    top = next(p for p in path.parents if not (p / "__init__.py").exists())
    if level:
        homes = [path.parents[level - 1]]
    elif parts[0] == PACKAGE.name:
        homes = [PACKAGE.parent]
    elif top in {PACKAGE.parent, *INSTALLED}:  # modules next to it are external
        homes = [top] if top / parts[0] in path.parents else []
    else:
        homes = [top, path.parent]
    files = [home.joinpath(*parts) for home in homes]
    modules = [m for f in files for m in (f / "__init__.py", Path(f"{f}.py"))]
    return next((module for module in modules if module.is_file()), None)
